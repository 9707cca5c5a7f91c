// A triangle that covers the screen, with all frame data that occlusion.frag uses: see FLAT in frame.glsl.
layout(location = 0) uniform vec4 frame_reach;
layout(location = 1) uniform int frame_taps;
layout(location = 2) uniform vec4 frame_image;
layout(location = 0) flat out vec4 image;
layout(location = 1) flat out vec2 depth;
layout(location = 2) flat out vec4 reach;
layout(location = 3) flat out int taps;
void main() {
  image = frame_image;
  depth = uniforms.depth.xy;
  reach = frame_reach;
  taps = frame_taps;
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}
