// Translucent surfaces transmit a share of the light, by a dither that sub-frames average out.
#ifdef DETAILED
layout(location = 2) in vec4 uv;
layout(location = 3) in vec4 vertex_color;
#elif defined(TEXTURED)
layout(location = 2) in vec2 uv;
#endif
void main() {
  float alpha = material.color.a * (1.0 - 0.75 * material.glass.x);
#ifdef DETAILED
  alpha *= texture(base_color_texture, uv_of(0, uv)).a * vertex_color.a;
  if (material.options.x > 0.0) alpha = alpha < material.options.x ? 0.0 : 1.0;
#elif defined(TEXTURED)
  alpha *= texture(base_color_texture, uv).a;
#endif
  if (alpha <= dither(gl_FragCoord.xy, frame.shadow.w)) discard;
}
