// Depth, normals, ids and motion: the current and the previous position of a vertex in the picture.
layout(location = 0) in vec3 in_position;
layout(location = 1) in vec3 in_normal;
#ifdef CLOTH
layout(location = 2) in vec3 in_before;
#else
layout(location = 9) in vec3 in_before;
#endif
#ifdef DETAILED
layout(location = 2) in vec2 in_uv;
layout(location = 6) in vec2 in_second_uv;
layout(location = 7) in vec4 in_color;
layout(location = 3) out vec4 uv;
layout(location = 4) out vec4 vertex_color;
#endif
layout(location = 0) uniform mat4 clip_from_mesh;
layout(location = 4) uniform mat4 clip_before_from_mesh;
layout(location = 8) uniform mat3 world_from_normal;

layout(location = 0) out vec3 normal;
layout(location = 1) out vec4 now;
layout(location = 2) out vec4 before;

void main() {
  normal = world_from_normal * in_normal;
  before = clip_before_from_mesh * vec4(in_before, 1.0);
  now = clip_from_mesh * vec4(in_position, 1.0);
  gl_Position = now;
#ifdef DETAILED
  uv = vec4(in_uv, in_second_uv);
  vertex_color = in_color;
#endif
}
