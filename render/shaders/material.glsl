layout(std140, binding = 1) uniform Material {
  vec4 color;
  vec4 pattern_color;  // w: size of a cell [m]
  vec4 emission;
  vec4 surface;        // metallic, roughness; for fabric, also the width of a thread [m] and the relief
  vec4 back;           // for fabric: colour of the back; w: translucency
  vec4 sheen;          // for fabric: colour of the sheen; w: 1 if the back has a colour of its own
  vec4 glass;  // fraction of transmitted light, 1 / index of refraction
#ifdef DETAILED
  vec4 specular;  // reflectance of a dielectric that faces the eye; w: glossiness, negative if not used
  vec4 coat;      // strength and roughness of the lacquer; scale of the normal map; strength of the occlusion
  vec4 velvet;    // colour of the sheen
  vec4 options;   // alpha cutoff; 1 if unlit; 1 if there is a normal map
  vec4 uv_rows[14];  // rows of the transform of each texture's coordinates; w of the first: set of coordinates
#endif
} material;

#ifdef TEXTURED
layout(binding = 1) uniform sampler2D base_color_texture;
layout(binding = 2) uniform sampler2D metallic_roughness_texture;
layout(binding = 3) uniform sampler2D emission_texture;
#ifdef DETAILED
layout(binding = 14) uniform sampler2D normal_texture;
layout(binding = 15) uniform sampler2D occlusion_texture;
layout(binding = 16) uniform sampler2D transmission_texture;
layout(binding = 17) uniform sampler2D specular_texture;

// Return the transformed coordinates of the k-th texture: from the given coordinates, or from the set of coordinates that
// the texture uses.
vec2 transformed_uv(int k, vec2 uv) {
  vec3 p = vec3(uv, 1.0);
  return vec2(dot(material.uv_rows[2 * k].xyz, p), dot(material.uv_rows[2 * k + 1].xyz, p));
}
vec2 uv_of(int k, vec4 uv) { return transformed_uv(k, material.uv_rows[2 * k].w > 0.5 ? uv.zw : uv.xy); }
#endif
#endif
