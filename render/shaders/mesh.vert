layout(location = 0) in vec3 in_position;
layout(location = 1) in vec3 in_normal;
layout(location = 2) in vec2 in_uv;
layout(location = 3) in vec4 row_x;  // world_from_mesh by rows, one per instance
layout(location = 4) in vec4 row_y;
layout(location = 5) in vec4 row_z;
#ifdef DETAILED
layout(location = 6) in vec2 in_second_uv;
layout(location = 7) in vec4 in_color;
layout(location = 8) in vec4 in_tangent;
#endif

#ifndef DEPTH
layout(location = 0) out vec3 position;
layout(location = 1) out vec3 normal;
#endif
#ifdef DETAILED
layout(location = 2) out vec4 uv;
layout(location = 3) out vec4 vertex_color;
layout(location = 4) out vec4 tangent;
#elif defined(TEXTURED)
layout(location = 2) out vec2 uv;
#endif
#if defined(PATTERN) || defined(TRIPLANAR)
// These locations follow the fields of FlatFrame.
layout(location = 27) out vec3 object_position;
layout(location = 28) out vec3 object_normal;
layout(location = 29) flat out vec3 axis_x;  // the object's axes in the world
layout(location = 30) flat out vec3 axis_y;
layout(location = 31) flat out vec3 axis_z;
#endif

invariant gl_Position;

void main() {
  vec4 p = vec4(in_position, 1.0);
  vec3 world = vec3(dot(row_x, p), dot(row_y, p), dot(row_z, p));
  gl_Position = uniforms.clip_from_world * vec4(world, 1.0);
#ifndef DEPTH
  // Normals are transformed by the cofactor matrix, the inverse transpose up to a factor.
  vec3 cx = cross(row_y.xyz, row_z.xyz), cy = cross(row_z.xyz, row_x.xyz), cz = cross(row_x.xyz, row_y.xyz);
  normal = normalize(vec3(dot(cx, in_normal), dot(cy, in_normal), dot(cz, in_normal)));
  if (dot(row_x.xyz, cx) < 0.0) normal = -normal;
  position = world;
#ifdef FLAT
  pass_frame();
#endif
#endif
#ifdef DETAILED
  uv = vec4(in_uv, in_second_uv);
  vertex_color = in_color;
  vec3 t = in_tangent.xyz;
  bool mirrored = dot(row_x.xyz, cross(row_y.xyz, row_z.xyz)) < 0.0;
  tangent = vec4(dot(row_x.xyz, t), dot(row_y.xyz, t), dot(row_z.xyz, t), mirrored ? -in_tangent.w : in_tangent.w);
#elif defined(TEXTURED)
  uv = in_uv;
#endif
#if defined(PATTERN) || defined(TRIPLANAR)
  object_position = in_position;
  object_normal = in_normal;
  axis_x = normalize(vec3(row_x.x, row_y.x, row_z.x));
  axis_y = normalize(vec3(row_x.y, row_y.y, row_z.y));
  axis_z = normalize(vec3(row_x.z, row_y.z, row_z.z));
#endif
}
