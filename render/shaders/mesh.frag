layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
#ifdef DETAILED
layout(location = 2) in vec4 uv;
layout(location = 3) in vec4 vertex_color;
layout(location = 4) in vec4 tangent;
#elif defined(TEXTURED)
layout(location = 2) in vec2 uv;
#endif
#if defined(PATTERN) || defined(TRIPLANAR)
layout(location = 27) in vec3 object_position;
layout(location = 28) in vec3 object_normal;
layout(location = 29) flat in vec3 axis_x;
layout(location = 30) flat in vec3 axis_y;
layout(location = 31) flat in vec3 axis_z;
#endif
layout(location = 0) uniform float min_alpha;  // smallest alpha that this pass draws
#ifndef SURFACE
layout(location = 0) out vec4 color;
#endif

#ifdef DETAILED
// Returns the normal from the normal map, whose Y axis points against v. Without given tangents, the directions of u and v come
// from derivatives (M. Mikkelsen, "Bump Mapping Unparametrized Surfaces on the GPU", 2010). The back shows the
// same bumps.
vec3 mapped_normal(vec3 n) {
  vec2 place = uv_of(3, uv);
  vec3 texel = 2.0 * texture(normal_texture, place).xyz - 1.0;
  texel.xy *= material.coat.z;
  float facing = gl_FrontFacing ? 1.0 : -1.0;
  vec3 px = dFdx(position), py = dFdy(position), a = cross(py, n), b = cross(n, px);
  vec2 ux = dFdx(place), uy = dFdy(place);
  vec3 along_u = a * ux.x + b * uy.x, against_v = -(a * ux.y + b * uy.y);
  float size = inversesqrt(max(max(dot(along_u, along_u), dot(against_v, against_v)), 1e-30));
  along_u *= size;
  against_v *= size;
  if (dot(tangent.xyz, tangent.xyz) > 1e-6) {
    along_u = normalize(tangent.xyz - n * dot(n, tangent.xyz));
    against_v = cross(facing * n, along_u) * (tangent.w < 0.0 ? -1.0 : 1.0);
  }
  return normalize(facing * (texel.x * along_u + texel.y * against_v) + max(texel.z, 0.01) * n);
}

// Returns the fraction of the mirrored light that an occlusion map leaves; 1 without occlusion. Rough surfaces reflect light
// from all directions, so the fraction is that of the ambient light. Smooth surfaces reflect light from one direction, which is
// less hidden in a perpendicular view (S. Lagarde and C. de Rousiers, "Moving Frostbite to Physically Based Rendering", 2014).
float mirrored_fraction_of(float occlusion, float roughness, float nv) {
  return saturate(pow(nv + occlusion, exp2(-16.0 * roughness - 1.0)) - 1.0 + occlusion);
}

#ifdef TRIPLANAR
// The texture from the three sides of the object, as RayMaterial::triplanar_texel() in ray_material.cpp.
vec4 triplanar_color(vec3 p, vec3 n) {
  vec3 weight = n * n;
  weight *= weight;
  weight /= weight.x + weight.y + weight.z;
  vec2 x = transformed_uv(0, vec2(n.x < 0.0 ? p.z : -p.z, -p.y)), y = transformed_uv(0, vec2(n.y < 0.0 ? -p.x : p.x, p.z)),
       z = transformed_uv(0, vec2(n.z < 0.0 ? -p.x : p.x, -p.y));
  return weight.x * texture(base_color_texture, x) + weight.y * texture(base_color_texture, y) +
         weight.z * texture(base_color_texture, z);
}
#endif

// A layer of lacquer (KHR_materials_clearcoat) and fibres at grazing angles (KHR_materials_sheen, see fabric.glsl) over
// the light of a surface.
vec3 with_layers(vec3 radiance, vec3 n, vec3 smooth_normal, vec3 view, Light light) {
  vec3 l = frame.sun_direction.xyz, h = normalize(l + view);
  vec3 sun = frame.sun_radiance.rgb * light.sun;
  float nl = saturate(dot(n, l)), nv = max(abs(dot(n, view)), 1e-3), nh = saturate(dot(n, h));
  vec3 sheen = material.velvet.rgb;
  float grazing = 1.0 - nv, sheen_sky = 0.03 + 0.45 * grazing * grazing * grazing;
  float sin2 = 1.0 - nh * nh, sheen_sun = 0.75 * sin2 * sin2 / (nl + nv - nl * nv);
  radiance = radiance * (1.0 - max(sheen.r, max(sheen.g, sheen.b)) * sheen_sky) +
             sheen * (sun * (nl * sheen_sun) + (light.around + light.lamps) * sheen_sky);
  n = smooth_normal;
  nl = saturate(dot(n, l)), nv = max(abs(dot(n, view)), 1e-3);
  float rough = material.coat.y, through = 1.0 - material.coat.x * fresnel_at(vec3(0.04), nv).r;
  vec3 coat = sun * (nl * sun_lobe(rough, normals_in_pixel(n), n, h, nl, nv) * fresnel_at(vec3(0.04), saturate(dot(view, h))).r) +
              reflected_light(view, n, rough, light) * sky_reflectance(vec3(0.04), rough, nv);
  return radiance * through + material.coat.x * coat;
}
#endif

void main() {
  vec3 view = normalize(frame.eye.xyz - position);
  vec3 smooth_normal = normalize(gl_FrontFacing ? normal : -normal), n = smooth_normal;
  float alpha = material.color.a;
  Surface s = Surface(material.color.rgb, material.surface.y, material.surface.x, material.emission.rgb, 0.0, ONE_NORMAL);
#ifdef PATTERN
  PatternSample pattern = pattern_sample(object_position, object_normal);
  s.albedo = pattern.color;
  s.roughness = saturate(s.roughness * pattern.roughness);
  n = normalize(n - (axis_x * pattern.slope.x + axis_y * pattern.slope.y + axis_z * pattern.slope.z));
#endif
#ifdef DETAILED
#ifdef TRIPLANAR
  vec4 base = triplanar_color(object_position, object_normal) * vertex_color;
#else
  vec4 base = texture(base_color_texture, uv_of(0, uv)) * vertex_color;
#endif
  vec4 metallic_roughness = texture(metallic_roughness_texture, uv_of(1, uv)), specular = texture(specular_texture, uv_of(6, uv));
  s.albedo *= base.rgb;
  alpha *= base.a;
  s.roughness *= metallic_roughness.g;
  s.metallic *= metallic_roughness.b;
  s.emission *= texture(emission_texture, uv_of(2, uv)).rgb;
  dielectric_f0 = material.specular.rgb * specular.rgb;
  if (material.specular.w >= 0.0) {
    s.albedo *= 1.0 - max(dielectric_f0.r, max(dielectric_f0.g, dielectric_f0.b));
    s.roughness = 1.0 - material.specular.w * specular.a;
  }
  if (material.options.z > 0.5) n = mapped_normal(smooth_normal);
  float occlusion = mix(1.0, texture(occlusion_texture, uv_of(4, uv)).r, material.coat.w);
  float transmitted = material.glass.x * texture(transmission_texture, uv_of(5, uv)).r;
  if (material.options.x > 0.0) {
    if (alpha < material.options.x) discard;
    alpha = 1.0;
  }
#else
  float occlusion = 1.0, transmitted = material.glass.x;
#ifdef TEXTURED
  vec4 base = texture(base_color_texture, uv);
  vec4 metallic_roughness = texture(metallic_roughness_texture, uv);
  s.albedo *= base.rgb;
  alpha *= base.a;
  s.roughness *= metallic_roughness.g;
  s.metallic *= metallic_roughness.b;
  s.emission *= texture(emission_texture, uv).rgb;
#endif
#endif
  if (alpha < min_alpha) discard;
  if (min_alpha > 0.5) alpha = 1.0;  // the opaque pass leaves no holes
#ifdef SURFACE
  // The mirror images of smooth metals and glass are traced per pixel, and without a filter they stay sharp. Where the
  // normal varies so much that a pixel shows half of the surroundings, they would have noise. 0.12: kSharpMirror in
  // render/trace/surface_rows.h.
  float filtered = filtered_roughness(s.roughness, n);
  bool own_mirror = (s.metallic > 0.5 || transmitted > 0.0) && s.roughness <= 0.12 && filtered <= 0.25;
  if (!own_mirror) s.roughness = filtered;
  float mirror = s.metallic > 0.5 ? 10.0 : s.roughness < 0.3 ? 2.0 : 0.0;
  write_surface(position, n, cross(dFdx(position), dFdy(position)), view, s.roughness + mirror);
#ifdef PLAIN
  surface_color = vec4(s.albedo, 0.5 + 0.5 * s.metallic);
#endif
#else
  s.lobe = s.roughness;
  s.normals = normals_in_pixel(n);
  s.roughness = filtered_roughness(s.roughness, n);
#ifdef ENDLESS
  vec4 fog = fog_to(position, horizon_haze(smooth_normal, view));
#else
  vec4 fog = fog_to(position);
#endif
  vec3 albedo = s.albedo;
#ifdef GLASS
  s.albedo *= 1.0 - transmitted;
#endif
#ifdef GLASS
  Light light = light_on_glass(n);
#else
  vec3 lamp_normal = n;
#ifdef ROUGH_PATTERN  // the pass of surfaces drew it without its relief
  lamp_normal = smooth_normal;
#endif
#ifdef DETAILED
  if (material.options.z > 0.5) lamp_normal = n;
#endif
  Light light = traced_light(n, smooth_normal, lamp_normal);
#endif
  light.around *= occlusion;
  light.open *= occlusion;
#ifdef DETAILED
  if (occlusion < 1.0) light.mirrored.rgb *= mirrored_fraction_of(occlusion, s.roughness, max(abs(dot(n, view)), 1e-3));
#endif
  vec3 radiance = shade(s, n, view, light) + highlights_of_lamps(mix(dielectric_f0, s.albedo, s.metallic));
#ifdef GLASS
  radiance += transmitted * seen_through(albedo, position, n, view);
#endif
#ifdef DETAILED
  radiance = with_layers(radiance, n, smooth_normal, view, light);
  if (material.options.y > 0.5) radiance = albedo;
#endif
  color = vec4((radiance * fog.w + fog.rgb) * alpha, alpha);
#ifdef GLASS
  color.a *= 1.0 - transmitted * background_through();
#endif
#endif
}
