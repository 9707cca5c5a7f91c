// Ambient occlusion for every second pixel in each direction: points on the screen around a pixel that are above its
// surface hide part of the sky (after M. McGuire et al., "The Alchemy Screen-Space Ambient Obscurance Algorithm",
// 2011).
layout(binding = 4) uniform sampler2D scene_depth;
layout(location = 0) flat in vec4 image;  // position at distance 1 in the eye's frame = image.xy * pixel + image.zw
layout(location = 1) flat in vec2 depth;  // distance along the view axis = x / (depth + y)
layout(location = 2) flat in vec4 reach;  // radius [m], the same at distance 1 [pixels], greatest radius [pixels], seed
layout(location = 3) flat in int taps;
layout(location = 0) out vec2 result;  // open share; distance along the view axis

float distance_at(ivec2 p) { return depth.x / (texelFetch(scene_depth, p, 0).r + depth.y); }

// Position of a pixel in the eye's frame: right, up, and away.
vec3 place_at(ivec2 p) { return vec3(image.xy * vec2(p) + image.zw, 1.0) * distance_at(p); }

// Difference to the neighbour that is on the same surface.
vec3 nearer(vec3 before, vec3 here, vec3 after) {
  vec3 a = here - before, b = after - here;
  return dot(a, a) < dot(b, b) ? a : b;
}

void main() {
  ivec2 size = textureSize(scene_depth, 0), p = min(2 * ivec2(gl_FragCoord.xy), size - 1);
  vec3 here = place_at(p);
  vec3 right = nearer(place_at(max(p - ivec2(1, 0), 0)), here, place_at(min(p + ivec2(1, 0), size - 1)));
  vec3 up = nearer(place_at(max(p - ivec2(0, 1), 0)), here, place_at(min(p + ivec2(0, 1), size - 1)));
  vec3 normal = normalize(cross(up, right));

  float distance = here.z, radius = min(reach.y / distance, reach.z), r2 = radius * distance / reach.y * reach.x;
  r2 *= r2;
  // Nothing to compute in the sky, or for a radius below one pixel.
  int n = texelFetch(scene_depth, p, 0).r == 0.0 || radius < 1.5 ? 0 : taps;
  float turn = 6.2831853 * dither(gl_FragCoord.xy, reach.w), start = dither(gl_FragCoord.yx, 0.37 + 7.0 * reach.w);
  vec2 a = vec2(cos(turn), sin(turn));
  float sum = 0.0;
  int k = 0;
  do {
    float share = (float(k) + start) / float(taps);
    ivec2 tap = p + ivec2(round(a * (radius * share * share + 1.5)));
    vec3 v = place_at(clamp(tap, ivec2(0), size - 1)) - here;
    float v2 = dot(v, v), fade = max(1.0 - v2 / r2, 0.0);
    sum += fade * max(dot(v, normal) * inversesqrt(v2 + 1e-12) - 0.08, 0.0);
    a = mat2(-0.73736888, -0.67549029, 0.67549029, -0.73736888) * a;  // rotation by the golden angle
  } while (++k < n);
  float hidden = n == 0 ? 0.0 : 5.0 * sum / float(taps);
  result = vec2(1.0 / (1.0 + hidden * (1.0 + hidden)), distance);
}
