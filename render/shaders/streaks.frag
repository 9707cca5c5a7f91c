// Lays a picture of the same size over the scene.
layout(binding = 6) uniform sampler2D splats;  // w: share of the scene that shows
layout(location = 0) out vec4 color;

void main() {
  vec4 splat = texelFetch(splats, ivec2(gl_FragCoord.xy), 0);
  color = vec4(splat.rgb, 1.0 - splat.a);
}
