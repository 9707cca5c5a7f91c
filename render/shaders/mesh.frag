layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
#ifdef TEXTURED
layout(location = 2) in vec2 uv;
#endif
#ifdef PATTERN
layout(location = 3) in vec3 object_position;
layout(location = 4) in vec3 object_normal;
layout(location = 5) flat in vec3 axis_x;
layout(location = 6) flat in vec3 axis_y;
layout(location = 7) flat in vec3 axis_z;
#endif
layout(location = 0) uniform float min_alpha;  // smallest alpha that this pass draws
layout(location = 0) out vec4 color;

// Roughness, increased where the normal varies within a pixel, so that highlights do not flicker (Kaplanyan and
// Tokuyoshi, "Stable Geometric Specular Antialiasing", 2019).
float filtered_roughness(float roughness, vec3 normal) {
  vec3 dx = dFdx(normal), dy = dFdy(normal);
  float variance = 0.25 * (dot(dx, dx) + dot(dy, dy));
  float a = roughness * roughness;
  return sqrt(sqrt(saturate(a * a + min(2.0 * variance, 0.18))));
}

void main() {
  vec3 view = normalize(frame.eye.xyz - position);
  vec3 smooth_normal = normalize(gl_FrontFacing ? normal : -normal), n = smooth_normal;
  float alpha = material.color.a;
  Surface s = Surface(material.color.rgb, material.surface.y, material.surface.x, material.emission.rgb);
#ifdef PATTERN
  PatternSample pattern = pattern_sample(object_position, object_normal);
  s.albedo = pattern.color;
  s.roughness = saturate(s.roughness * pattern.roughness);
  n = normalize(n - (axis_x * pattern.slope.x + axis_y * pattern.slope.y + axis_z * pattern.slope.z));
#endif
#ifdef TEXTURED
  vec4 base = texture(base_color_texture, uv);
  vec4 metallic_roughness = texture(metallic_roughness_texture, uv);
  s.albedo *= base.rgb;
  alpha *= base.a;
  s.roughness *= metallic_roughness.g;
  s.metallic *= metallic_roughness.b;
  s.emission *= texture(emission_texture, uv).rgb;
#endif
  if (alpha < min_alpha) discard;
  if (min_alpha > 0.5) alpha = 1.0;  // the opaque pass leaves no holes
  s.roughness = filtered_roughness(s.roughness, n);
#ifdef ENDLESS
  vec4 fog = fog_to(position, horizon_haze(smooth_normal, view));
#else
  vec4 fog = fog_to(position);
#endif
#ifdef MIRROR
  // Added to the picture drawn so far.
  vec4 scene = seen_in_mirror(position, n, view, s.roughness);
  color = vec4(mirror_gain(s, n, view, open_sky(1.0 / gl_FragCoord.w), scene) * fog.w, 0.0);
#else
  vec3 albedo = s.albedo;
#ifdef GLASS
  s.albedo *= 1.0 - material.glass.x;
#endif
  vec3 radiance = shade(s, n, view, sun_visibility(position, smooth_normal), open_sky(1.0 / gl_FragCoord.w));
#ifdef LAMPS
  radiance += lamp_light(s, n, smooth_normal, view, position);
#endif
#ifdef GLASS
  radiance += albedo * (material.glass.x * seen_through(position, n, view));
#endif
  color = vec4((radiance * fog.w + fog.rgb) * alpha, alpha);
#endif
}
