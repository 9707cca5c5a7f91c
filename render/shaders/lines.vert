// One quad per line on the screen, drawn as with a round pen from a to b.
layout(location = 0) in vec4 in_a;  // w: width there, as a factor
layout(location = 1) in vec4 in_b;
layout(location = 2) in vec4 in_color;
layout(location = 0) uniform vec2 half_size;  // half the size of the picture [px]
layout(location = 1) uniform float half_width;  // half the width of a line with the factor 1 [px]

layout(location = 0) out vec2 place;             // coordinates along the line from a, and across it [px]
layout(location = 1) flat out vec3 stroke;       // length, half width at a and at b [px]
layout(location = 2) flat out vec4 color;

void main() {
  bool at_b = (gl_VertexID & 1) != 0;
  float side = (gl_VertexID & 2) != 0 ? 1.0 : -1.0;
  vec4 a = uniforms.clip_from_world * vec4(in_a.xyz, 1.0), b = uniforms.clip_from_world * vec4(in_b.xyz, 1.0);
  vec2 pa = a.xy / a.w * half_size, pb = b.xy / b.w * half_size;
  float length_px = distance(pa, pb);
  vec2 u = length_px > 1e-3 ? (pb - pa) / length_px : vec2(1.0, 0.0), v = vec2(-u.y, u.x);

  stroke = vec3(length_px, half_width * in_a.w, half_width * in_b.w);
  color = in_color;
  float reach = max(stroke.y, stroke.z) + 1.0;
  place = vec2(at_b ? length_px + reach : -reach, side * reach);
  vec2 p = pa + u * place.x + v * place.y;
  // A line has the depth of the front of a tube of its width, so that a surface does not cut a line on it.
  float w = at_b ? b.w : a.w;
  float front = w * (1.0 - (at_b ? stroke.z : stroke.y) * frame.eye.w);
  gl_Position = vec4(p / half_size, saturate(uniforms.depth.x / front - uniforms.depth.y), 1.0);
}
