// Translucent surfaces transmit a share of the light, by a dither that sub-frames average out.
#ifdef TEXTURED
layout(location = 2) in vec2 uv;
#endif
void main() {
  float alpha = material.color.a * (1.0 - 0.75 * material.glass.x);
#ifdef TEXTURED
  alpha *= texture(base_color_texture, uv).a;
#endif
  if (alpha <= dither(gl_FragCoord.xy, frame.shadow.w)) discard;
}
