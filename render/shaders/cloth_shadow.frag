// The shadow of translucent cloth, by a dither that sub-frames and the filter of soft edges average out.
layout(location = 2) in vec3 place;
#ifdef TEXTURED
layout(location = 1) uniform vec2 texture_from_uv;
#endif
void main() {
  float opacity = material.color.a * (1.0 - material.glass.x);
#ifdef TEXTURED
  opacity *= texture(base_color_texture, place.xy * texture_from_uv).a;
#endif
  if (opacity <= hole(place.xy)) discard;
}
