layout(location = 0) in vec4 in_position;  // w: hollowness of the front at the vertex
layout(location = 1) in vec4 in_normal;    // w: half the thickness [m]
layout(location = 2) in vec2 in_uv;        // along the cloth [m]

#ifdef SHADOW
layout(location = 0) uniform mat4 shadow_clip_from_world;
#ifdef SHEER
layout(location = 2) out vec3 place;
#endif
#else
layout(location = 0) out vec3 position;
layout(location = 1) out vec4 normal;  // w: height of `position` over the middle layer [m]
layout(location = 2) out vec3 place;  // uv, and hollowness of the front
// Depth is drawn first, by another program.
invariant gl_Position;
#endif

void main() {
#ifdef SHADOW
  gl_Position = shadow_clip_from_world * vec4(in_position.xyz, 1.0);
#ifdef SHEER
  place = vec3(in_uv, in_position.w);
#endif
#else
  // The single layer stands for the visible side; towards the outline it blends into the other side.
  vec3 view = normalize(frame.eye.xyz - in_position.xyz);
  float lift = in_normal.w * clamp(8.0 * dot(in_normal.xyz, view), -1.0, 1.0);
  position = in_position.xyz + lift * in_normal.xyz;
  normal = vec4(in_normal.xyz, lift);
  place = vec3(in_uv, in_position.w);
#ifdef FLAT
  pass_frame();
#endif
  gl_Position = uniforms.clip_from_world * vec4(position, 1.0);
#endif
}
