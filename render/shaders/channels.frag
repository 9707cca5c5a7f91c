layout(location = 0) in vec3 normal;
layout(location = 1) in vec4 now;
layout(location = 2) in vec4 before;
#ifdef DETAILED
layout(location = 3) in vec4 uv;
layout(location = 4) in vec4 vertex_color;
#endif
layout(location = 11) uniform vec3 half_size_id;  // half the picture [px], y downwards; id
layout(location = 0) out vec4 normal_id;
layout(location = 1) out vec4 motion_depth;

void main() {
#ifdef DETAILED  // a surface with holes
  float alpha = material.color.a * texture(base_color_texture, uv_of(0, uv)).a * vertex_color.a;
  if (alpha < material.options.x) discard;
#endif
  normal_id = vec4(normalize(gl_FrontFacing ? normal : -normal), half_size_id.z);
  // A point behind the eye has no previous position in the picture.
  vec2 motion = before.w > 0.0 ? now.xy / now.w - before.xy / before.w : vec2(0.0);
  motion_depth = vec4(half_size_id.xy * motion, now.w, 0.0);
}
