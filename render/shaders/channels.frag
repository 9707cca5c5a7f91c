layout(location = 0) in vec3 normal;
layout(location = 1) in vec4 now;
layout(location = 2) in vec4 before;
layout(location = 11) uniform vec3 half_size_id;  // half the picture [px], y downwards; id
layout(location = 0) out vec4 normal_id;
layout(location = 1) out vec4 motion_depth;

void main() {
  normal_id = vec4(normalize(gl_FrontFacing ? normal : -normal), half_size_id.z);
  // A point behind the eye has no previous position in the picture.
  vec2 way = before.w > 0.0 ? now.xy / now.w - before.xy / before.w : vec2(0.0);
  motion_depth = vec4(half_size_id.xy * way, now.w, 0.0);
}
