// How much of the sky near things leave, for every second pixel each way: places on the screen around a pixel that stand
// above its surface hide some (after M. McGuire et al., "The Alchemy Screen-Space Ambient Obscurance Algorithm", 2011).
layout(binding = 4) uniform sampler2D scene_depth;
layout(location = 0) uniform vec4 reach;  // radius [m], the same at distance 1 [pixels], the widest [pixels], seed
layout(location = 1) uniform int taps;
layout(location = 0) out vec2 result;     // share; distance along the view axis

float distance_at(ivec2 p) { return frame.depth.x / (texelFetch(scene_depth, p, 0).r + frame.depth.y); }

// Of a pixel, from the eye.
vec3 place_at(ivec2 p, vec2 ndc_per_pixel) {
  vec2 ndc = (vec2(p) + 0.5) * ndc_per_pixel - 1.0;
  return (frame.ray_center.xyz + frame.ray_x.xyz * ndc.x + frame.ray_y.xyz * ndc.y) * distance_at(p);
}

// The difference to the neighbour that is on the same surface.
vec3 nearer(vec3 before, vec3 here, vec3 after) {
  vec3 a = here - before, b = after - here;
  return dot(a, a) < dot(b, b) ? a : b;
}

void main() {
  ivec2 size = textureSize(scene_depth, 0), p = min(2 * ivec2(gl_FragCoord.xy), size - 1);
  vec2 per_pixel = 2.0 / vec2(size);
  vec3 here = place_at(p, per_pixel);
  vec3 right = nearer(place_at(max(p - ivec2(1, 0), 0), per_pixel), here, place_at(min(p + ivec2(1, 0), size - 1), per_pixel));
  vec3 up = nearer(place_at(max(p - ivec2(0, 1), 0), per_pixel), here, place_at(min(p + ivec2(0, 1), size - 1), per_pixel));
  vec3 normal = normalize(cross(right, up));

  float distance = distance_at(p), radius = min(reach.y / distance, reach.z), r2 = radius * distance / reach.y * reach.x;
  r2 *= r2;
  // Nothing to find in the sky, nor in less than a pixel.
  int n = texelFetch(scene_depth, p, 0).r == 0.0 || radius < 1.5 ? 0 : taps;
  float turn = 6.2831853 * dither(gl_FragCoord.xy, reach.w), start = dither(gl_FragCoord.yx, 0.37 + reach.w);
  vec2 a = vec2(cos(turn), sin(turn));
  float sum = 0.0;
  for (int k = 0; k < n; ++k) {
    float share = (float(k) + start) / float(taps);
    ivec2 tap = p + ivec2(round(a * (radius * share * share + 1.5)));
    vec3 v = place_at(clamp(tap, ivec2(0), size - 1), per_pixel) - here;
    float v2 = dot(v, v), fade = max(1.0 - v2 / r2, 0.0);
    sum += fade * max(dot(v, normal) * inversesqrt(v2 + 1e-12) - 0.08, 0.0);
    a = mat2(-0.73736888, -0.67549029, 0.67549029, -0.73736888) * a;  // by the golden angle
  }
  float hidden = 5.0 * sum / float(taps);
  result = vec2(1.0 / (1.0 + hidden * (1.0 + hidden)), distance);
}
