// Light of surfaces, which was traced for this sub-frame (render/trace).
layout(binding = 8) uniform sampler2D traced_arriving;    // from the sky and other surfaces; w: visible fraction of the sun
#ifdef TINTED_SUN
layout(binding = 9) uniform sampler2D traced_sun;         // visible fraction of the sun per channel
#endif
layout(binding = 10) uniform sampler2D traced_lamps;      // diffuse light of lamps; w: see unpacked_direction()
layout(binding = 18) uniform sampler2D traced_mirrored;   // w: 1 where it was computed
layout(binding = 19) uniform sampler2D traced_highlights; // specular light of lamps; w: its Fresnel factor

float luminance(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }

// The inverse of packed_direction() in render/trace/packed_direction.h; zero if there is no direction.
vec3 unpacked_direction(float code) {
  if (code < 0.5) return vec3(0.0);
  float row = floor((code - 1.0) / 4095.0);
  vec2 p = vec2(code - 1.0 - 4095.0 * row, row) / 2047.0 - 1.0;
  float z = 1.0 - abs(p.x) - abs(p.y);
  if (z < 0.0) p = (1.0 - abs(p.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(p, vec2(0.0)));
  return normalize(vec3(p, z));
}

// The light of lamps on a surface with the unit normal `normal`; it was traced for the normal `traced`. As lamp_relief() in
// render/trace/packed_direction.h.
vec3 light_of_lamps(vec3 normal, vec3 traced) {
#ifdef LAMPS
  vec4 light = texelFetch(traced_lamps, ivec2(gl_FragCoord.xy), 0);
  if (normal == traced) return light.rgb;
  vec3 towards = unpacked_direction(light.w);
  float cosine = dot(traced, towards);
  return cosine > 0.0 ? light.rgb * min(max(dot(normal, towards), 0.0) / cosine, 3.0) : light.rgb;
#else
  return vec3(0.0);
#endif
}

// `normal`: with all detail. The light from around was traced for the smooth normal, and that of lamps for `lamp_normal`.
Light traced_light(vec3 normal, vec3 smooth_normal, vec3 lamp_normal) {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 arriving = texelFetch(traced_arriving, pixel, 0);
  float sky = luminance(ambient(smooth_normal)) + 1e-4;
  float relief = clamp((luminance(ambient(normal)) + 1e-4) / sky, 0.5, 1.5);
#ifdef TINTED_SUN
  vec3 sun = texelFetch(traced_sun, pixel, 0).rgb;
#else
  vec3 sun = vec3(arriving.w);
#endif
  return Light(sun, relief * arriving.rgb, light_of_lamps(normal, lamp_normal), saturate(luminance(arriving.rgb) / sky), texelFetch(traced_mirrored, pixel, 0));
}

vec3 highlights_of_lamps(vec3 f0) {
#ifdef LAMPS
  vec4 lobes = texelFetch(traced_highlights, ivec2(gl_FragCoord.xy), 0);
  return lobes.rgb * (f0 + (1.0 - f0) * lobes.w);
#else
  return vec3(0.0);
#endif
}
