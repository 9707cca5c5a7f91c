// Refraction by a solid piece of glass: its far side is approximated by a ball as thick as the piece, and the
// background is read from the finished picture of the opaque objects.
layout(location = 1) uniform float thickness;  // [m]
layout(binding = 12) uniform sampler2D behind;

vec3 seen_through(vec3 position, vec3 n, vec3 view) {
  vec3 inside = refract(-view, n, material.glass.y);
  float way = thickness * max(-dot(inside, n), 0.0);
  vec3 far_side = position + way * inside, out_normal = normalize(far_side - (position - 0.5 * thickness * n));
  vec3 leaving = refract(inside, -out_normal, 1.0 / material.glass.y);
  if (thickness <= 0.0) leaving = -view;  // a sheet with parallel sides does not turn the ray
  else if (dot(leaving, leaving) < 0.5) leaving = inside;  // total reflection inside
  vec3 f0 = vec3(pow((1.0 - material.glass.y) / (1.0 + material.glass.y), 2.0));
  vec4 clip = uniforms.clip_from_world * vec4(far_side + thickness * leaving, 1.0);
  vec2 place = 0.5 + 0.5 * clip.xy / clip.w;
  vec2 off = abs(place - 0.5);
  float on_screen = clip.w > 0.0 ? 1.0 - smoothstep(0.46, 0.5, max(off.x, off.y)) : 0.0;
  vec3 light = mix(sky_reflection(leaving, 0.05), texture(behind, clamp(place, 0.0, 1.0)).rgb, on_screen);
  return light * (1.0 - fresnel_at(f0, max(dot(view, n), 0.0)));
}
