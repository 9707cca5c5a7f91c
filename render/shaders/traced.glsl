// Light of surfaces, which was traced for this sub-frame (render/trace).
layout(binding = 8) uniform sampler2D traced_arriving;    // from the sky and other surfaces; w: visible fraction of the sun
#ifdef TINTED_SUN
layout(binding = 9) uniform sampler2D traced_sun;         // visible fraction of the sun per channel
#endif
layout(binding = 10) uniform sampler2D traced_lamps;      // diffuse light of lamps
layout(binding = 18) uniform sampler2D traced_mirrored;   // w: 1 where it was computed
layout(binding = 19) uniform sampler2D traced_highlights; // specular light of lamps; w: its Fresnel factor

float luminance(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }

vec3 light_of_lamps() {
#ifdef LAMPS
  return texelFetch(traced_lamps, ivec2(gl_FragCoord.xy), 0).rgb;
#else
  return vec3(0.0);
#endif
}

// `normal`: with all detail; the light was traced for the smooth one.
Light traced_light(vec3 normal, vec3 smooth_normal) {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 arriving = texelFetch(traced_arriving, pixel, 0);
  float sky = luminance(ambient(smooth_normal)) + 1e-4;
  float relief = clamp((luminance(ambient(normal)) + 1e-4) / sky, 0.5, 1.5);
#ifdef TINTED_SUN
  vec3 sun = texelFetch(traced_sun, pixel, 0).rgb;
#else
  vec3 sun = vec3(arriving.w);
#endif
  return Light(sun, relief * arriving.rgb, relief * light_of_lamps(), saturate(luminance(arriving.rgb) / sky), texelFetch(traced_mirrored, pixel, 0));
}

vec3 highlights_of_lamps(vec3 f0) {
#ifdef LAMPS
  vec4 lobes = texelFetch(traced_highlights, ivec2(gl_FragCoord.xy), 0);
  return lobes.rgb * (f0 + (1.0 - f0) * lobes.w);
#else
  return vec3(0.0);
#endif
}
