layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal;
layout(location = 2) in vec2 uv;
layout(location = 0) uniform vec3 texture_rows[2];  // from the place on the cloth [m]
vec2 texture_place(vec2 p) { return vec2(dot(texture_rows[0], vec3(p, 1.0)), dot(texture_rows[1], vec3(p, 1.0))); }
#ifndef SURFACE
layout(location = 0) out vec4 color;
#endif

void main() {
  vec3 view = normalize(frame.eye.xyz - position);
  float side = gl_FrontFacing ? 1.0 : -1.0;
  vec3 n = normalize(normal.xyz) * side;
  n = normalize(n + view * max(0.02 - dot(n, view), 0.0));  // smooth normals can turn away at outlines
#ifdef SHEER
  float opacity = material.color.a * (1.0 - material.glass.x);
#ifdef TEXTURED
  opacity *= texture(base_color_texture, texture_place(uv)).a;
#endif
  if (opacity == 0.0) discard;
  float alpha = opacity;
  if (normal.w > 0.0) alpha = 1.0 - pow(1.0 - opacity, 1.0 / max(dot(n, view), 0.1));  // more fibres cover a slanted view; not at the rim
#endif
#ifdef SURFACE
  vec3 middle = position - normal.xyz * normal.w;
  write_surface(middle, n, cross(dFdx(middle), dFdy(middle)), view, material.surface.y + 4.0);
#else
  Surface s = Surface(material.color.rgb, material.surface.y, material.surface.x, material.emission.rgb, 0.0, ONE_NORMAL);
  vec2 slope = vec2(0.0);
#ifdef PATTERN
  PatternSample pattern = pattern_sample(vec3(uv, 0.0), vec3(0.0, 0.0, 1.0));
  s.albedo = pattern.color;
  s.roughness = saturate(s.roughness * pattern.roughness);
  slope = pattern.slope.xy;
#endif
#ifdef TEXTURED
  s.albedo *= texture(base_color_texture, texture_place(uv)).rgb;
#endif
  vec3 through = s.albedo;
  if (material.sheen.w != 0.0) {
    through = sqrt(s.albedo * material.back.rgb);
    if (!gl_FrontFacing) s.albedo = material.back.rgb;
  }
  s.lobe = s.roughness;
  Threads weave = threads(uv);
  s.albedo *= weave.shade;
  // The transmitted light has a more saturated colour, because it has travelled farther in the cloth.
  through *= s.albedo / max(max(s.albedo.r, s.albedo.g), max(s.albedo.b, 1e-3));
  slope += weave.slope;
  mat2x3 along = cloth_frame(position, n, uv);
  vec3 relief = normalize(n - side * (along[0] * slope.x + along[1] * slope.y));

  vec3 radiance = shade_fabric(s, through, relief, view, traced_light(relief, n, n)) +
                  highlights_of_lamps(mix(vec3(0.04), s.albedo, s.metallic));
  radiance = apply_fog(radiance, position);
#ifdef SHEER
  color = vec4(radiance * alpha, alpha);
#else
  color = vec4(radiance, 1.0);
#endif
#endif
}
