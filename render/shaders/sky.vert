// A triangle that covers the screen, at the far plane.
layout(location = 0) out vec3 ray;
void main() {
  vec2 ndc = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  ray = uniforms.ray_center.xyz + uniforms.ray_x.xyz * ndc.x + uniforms.ray_y.xyz * ndc.y;
#ifdef FLAT
  pass_frame();
#endif
  gl_Position = vec4(ndc, 0.0, 1.0);
}
