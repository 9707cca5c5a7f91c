// Light through a piece of glass, which was traced for this sub-frame (render/trace).
layout(binding = 20) uniform sampler2D traced_through;  // w: visible fraction of the sun
layout(binding = 21) uniform sampler2D traced_by_glass; // mirror image; w: visible fraction of a transparent background
#ifdef PARTICLES
// Rays do not find sprites, streaks and smoke. Their light behind glass is the difference of two pictures, with and without
// them. The pictures are read where the refracted ray would arrive if the piece of glass were a ball of its thickness.
layout(location = 1) uniform float thickness;  // [m]; 0: a sheet
layout(binding = 12) uniform sampler2D behind;
layout(binding = 22) uniform sampler2D behind_without_particles;

vec3 particles_behind(vec3 position, vec3 n, vec3 view) {
  vec3 inside = refract(-view, n, material.glass.y);
  float path_length = thickness * max(-dot(inside, n), 0.0);
  vec3 far_side = position + path_length * inside, out_normal = normalize(far_side - (position - 0.5 * thickness * n));
  vec3 leaving = refract(inside, -out_normal, 1.0 / material.glass.y);
  if (thickness <= 0.0) leaving = -view;  // a sheet with parallel sides does not turn the ray
  else if (dot(leaving, leaving) < 0.5) leaving = inside;  // total reflection inside
  vec4 clip = uniforms.clip_from_world * vec4(far_side + thickness * leaving, 1.0);
  vec2 place = 0.5 + 0.5 * clip.xy / clip.w, off = abs(place - 0.5);
  float on_screen = clip.w > 0.0 ? 1.0 - smoothstep(0.46, 0.5, max(off.x, off.y)) : 0.0;
  place = clamp(place, 0.0, 1.0);
  return on_screen * (texture(behind, place).rgb - texture(behind_without_particles, place).rgb);
}
#endif

vec3 seen_through(vec3 color, vec3 position, vec3 n, vec3 view) {
  vec3 light = texelFetch(traced_through, ivec2(gl_FragCoord.xy), 0).rgb;
#ifdef PARTICLES
  light = max(light + color * particles_behind(position, n, view), 0.0);
#endif
  return light;
}

// Returns the fraction of a transparent background that is visible through the glass.
float background_through() {
  return texelFetch(traced_by_glass, ivec2(gl_FragCoord.xy), 0).w;
}

Light light_on_glass(vec3 normal) {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec3 mirrored = texelFetch(traced_by_glass, pixel, 0).rgb;
  return Light(vec3(texelFetch(traced_through, pixel, 0).w), ambient(normal), light_of_lamps(normal, normal), 1.0, vec4(mirrored, 1.0));
}
