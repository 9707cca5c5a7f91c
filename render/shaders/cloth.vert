layout(location = 0) in vec3 in_position;
layout(location = 1) in vec4 in_normal;    // w: half the thickness [m]
layout(location = 2) in vec2 in_uv;        // along the cloth [m]

layout(location = 0) out vec3 position;
layout(location = 1) out vec4 normal;  // w: height of `position` over the middle layer [m]
layout(location = 2) out vec2 uv;
// Depth is drawn first, by another program.
invariant gl_Position;

void main() {
  // The mesh is the middle layer. It is moved to the surface on the visible side, and less towards the outline, where
  // both surfaces meet.
  vec3 view = normalize(frame.eye.xyz - in_position);
  float lift = in_normal.w * clamp(8.0 * dot(in_normal.xyz, view), -1.0, 1.0);
  position = in_position + lift * in_normal.xyz;
  normal = vec4(in_normal.xyz, lift);
  uv = in_uv;
#ifdef FLAT
  pass_frame();
#endif
  gl_Position = uniforms.clip_from_world * vec4(position, 1.0);
}
