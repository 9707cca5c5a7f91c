// Shades the plain surfaces of a quick picture from the values that surface.glsl wrote. There is one invocation for each
// pixel, instead of one for each triangle in it.
layout(binding = 25) uniform sampler2D surface_places;
layout(binding = 26) uniform sampler2D surface_normals;
layout(binding = 27) uniform sampler2D surface_colors;  // a: 0 where the surface is not plain, else 0.5 + 0.5 * metallic

layout(location = 0) out vec4 color;

vec3 from_octahedral(vec2 p) {
  p = 2.0 * p - 1.0;
  vec3 n = vec3(p.x, 1.0 - abs(p.x) - abs(p.y), p.y);
  if (n.y < 0.0) n.xz = (1.0 - abs(n.zx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.z < 0.0 ? -1.0 : 1.0);
  return normalize(n);
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 own = texelFetch(surface_colors, pixel, 0);
  if (own.a == 0.0) discard;
  vec4 place = texelFetch(surface_places, pixel, 0);
  vec3 n = from_octahedral(texelFetch(surface_normals, pixel, 0).xy), view = normalize(frame.eye.xyz - place.xyz);
  float roughness = place.w - 2.0 * floor(0.5 * place.w);  // without the flags, which are multiples of 2
  float metallic = 2.0 * own.a - 1.0;
  // The inverse of filtered_roughness(), which mesh.frag does not apply to smooth metals.
  float r2 = roughness * roughness;
  float lobe = metallic > 0.5 && roughness <= 0.12 ? roughness : sqrt(sqrt(max(r2 * r2 - added_roughness4(n), 0.0)));
  Surface s = Surface(own.rgb, roughness, metallic, vec3(0.0), lobe, normals_in_pixel(n));
  vec3 radiance = shade(s, n, view, traced_light(n, n, n)) + highlights_of_lamps(mix(dielectric_f0, s.albedo, s.metallic));
  color = vec4(apply_fog(radiance, place.xyz), 1.0);
}
