// Light of opaque surfaces, which was traced for this sub-frame (render/trace).
layout(binding = 8) uniform sampler2D traced_arriving;    // from the sky and other surfaces; w: visible share of the sun
layout(binding = 10) uniform sampler2D traced_lamps;      // diffuse light of lamps; w: Fresnel factor of their highlights
layout(binding = 18) uniform sampler2D traced_mirrored;   // w: 1 where it was computed
layout(binding = 19) uniform sampler2D traced_highlights; // lobes of lamps

float luminance(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }

// `normal`: with all detail; the light was traced for the smooth one.
Light traced_light(vec3 normal, vec3 smooth_normal) {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 arriving = texelFetch(traced_arriving, pixel, 0);
  float sky = luminance(ambient(smooth_normal)) + 1e-4;
  float relief = clamp((luminance(ambient(normal)) + 1e-4) / sky, 0.5, 1.5);
  vec3 lamps = vec3(0.0);
#ifdef LAMPS
  lamps = texelFetch(traced_lamps, pixel, 0).rgb;
#endif
  return Light(arriving.w, relief * arriving.rgb, relief * lamps, saturate(luminance(arriving.rgb) / sky), texelFetch(traced_mirrored, pixel, 0));
}

#ifdef LAMPS
vec3 traced_highlight(vec3 f0) {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  return texelFetch(traced_highlights, pixel, 0).rgb * (f0 + (1.0 - f0) * texelFetch(traced_lamps, pixel, 0).w);
}
#endif
