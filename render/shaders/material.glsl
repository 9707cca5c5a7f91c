layout(std140, binding = 1) uniform Material {
  vec4 color;
  vec4 pattern_color;  // w: size of a cell [m]
  vec4 emission;
  vec4 surface;        // metallic, roughness
} material;

#ifdef TEXTURED
layout(binding = 1) uniform sampler2D base_color_texture;
layout(binding = 2) uniform sampler2D metallic_roughness_texture;
layout(binding = 3) uniform sampler2D emission_texture;
#endif
