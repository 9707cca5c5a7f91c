layout(std140, binding = 1) uniform Material {
  vec4 color;
  vec4 pattern_color;  // w: size of a cell [m]
  vec4 emission;
  vec4 surface;        // metallic, roughness; of fabric: width of a thread [m], relief
  vec4 back;           // of fabric: colour of its back; w: translucency
  vec4 sheen;          // of fabric: colour; w: 1 if the back has a colour of its own
  vec4 glass;  // share of transmitted light, 1 / index of refraction
} material;

#ifdef TEXTURED
layout(binding = 1) uniform sampler2D base_color_texture;
layout(binding = 2) uniform sampler2D metallic_roughness_texture;
layout(binding = 3) uniform sampler2D emission_texture;
#endif
