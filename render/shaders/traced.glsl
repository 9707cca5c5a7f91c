// Light of opaque surfaces, which was traced for this sub-frame (render/trace).
layout(binding = 8) uniform sampler2D traced_direct;      // visible share of the sun; yzw: diffuse light of lamps
layout(binding = 10) uniform sampler2D traced_around;     // half the picture's size; w: distance along the view axis
layout(binding = 11) uniform sampler2D traced_normals;    // of the same pixels
layout(binding = 18) uniform sampler2D traced_mirrored;   // w: 1 where it was computed
layout(binding = 19) uniform sampler2D traced_highlights; // lobes of lamps; w: Fresnel factor

float luminance(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }

// Of the four values around a pixel, those at a similar distance and orientation are used.
vec3 light_around(float distance, vec3 normal) {
  vec2 p = 0.5 * (gl_FragCoord.xy - 0.5) - 0.25;
  ivec2 first = ivec2(floor(p)), last = textureSize(traced_around, 0) - 1;
  vec2 f = p - floor(p);
  vec3 sum = vec3(0.0);
  float weights = 0.0;
  for (int k = 0; k < 4; ++k) {
    ivec2 offset = ivec2(k & 1, k >> 1), place = clamp(first + offset, ivec2(0), last);
    vec4 value = texelFetch(traced_around, place, 0);
    vec2 share = mix(1.0 - f, f, vec2(offset));
    float off = value.w / distance - 1.0, facing = max(dot(texelFetch(traced_normals, place, 0).xyz, normal), 0.0);
    facing *= facing;
    facing *= facing;
    float weight = value.w == 0.0 ? 0.0 : (share.x * share.y + 0.002) * (facing * facing + 1e-4) / (1.0 + 1e4 * off * off);
    sum += weight * value.rgb;
    weights += weight;
  }
  return sum / max(weights, 1e-12);
}

// `normal`: with all detail; the light around was traced for the smooth one. `distance`: along the view axis.
Light traced_light(vec3 normal, vec3 smooth_normal, float distance) {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 direct = texelFetch(traced_direct, pixel, 0);
  vec3 around = light_around(distance, smooth_normal);
  float sky = luminance(ambient(smooth_normal)) + 1e-4;
  float relief = clamp((luminance(ambient(normal)) + 1e-4) / sky, 0.5, 1.5);
  return Light(direct.x, relief * (around + direct.yzw), saturate(luminance(around) / sky), texelFetch(traced_mirrored, pixel, 0));
}

vec3 traced_highlight(vec3 f0) {
  vec4 lobes = texelFetch(traced_highlights, ivec2(gl_FragCoord.xy), 0);
  return lobes.rgb * (f0 + (1.0 - f0) * lobes.w);
}
