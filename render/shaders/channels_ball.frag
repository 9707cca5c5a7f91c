// Depth, normal, id and motion of a ball, by ray casting on its quad.
layout(location = 2) flat in vec4 ball;  // centre, radius
layout(location = 3) in vec3 on_quad;  // position on the quad, from the centre
layout(location = 4) flat in vec3 velocity;
layout(location = 4) uniform mat4 clip_before_from_world;
// Half the picture [px], y downwards; id; time since the previous transforms.
layout(location = 11) uniform vec4 half_size_id_time;
layout(location = 0) out vec4 normal_id;
layout(location = 1) out vec4 motion_depth;

void main() {
  vec3 ray = normalize(ball.xyz - frame.eye.xyz + on_quad);
  vec3 nearest = on_quad - ray * dot(on_quad, ray);  // from the centre to the ray, as in sphere.frag
  float h2 = ball.w * ball.w - dot(nearest, nearest);
  if (h2 < 0.0) discard;
  vec3 offset = nearest - ray * sqrt(h2), hit = ball.xyz + offset;
  vec4 now = uniforms.clip_from_world * vec4(hit, 1.0);
  vec4 before = clip_before_from_world * vec4(hit - half_size_id_time.w * velocity, 1.0);
  gl_FragDepth = now.z / now.w;
  normal_id = vec4(offset / ball.w, half_size_id_time.z);
  vec2 motion = before.w > 0.0 ? now.xy / now.w - before.xy / before.w : vec2(0.0);
  motion_depth = vec4(half_size_id_time.xy * motion, now.w, 0.0);
}
