// The shadow of translucent cloth, by a dither that sub-frames and the filter of soft edges average out.
layout(location = 2) in vec3 place;
#ifdef TEXTURED
layout(location = 1) uniform vec3 texture_rows[2];
#endif
void main() {
  float opacity = material.color.a * (1.0 - material.glass.x);
#ifdef TEXTURED
  opacity *= texture(base_color_texture, vec2(dot(texture_rows[0], vec3(place.xy, 1.0)), dot(texture_rows[1], vec3(place.xy, 1.0)))).a;
#endif
  if (opacity <= hole(place.xy)) discard;
}
