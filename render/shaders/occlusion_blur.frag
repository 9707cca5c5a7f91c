// Mean over three by three texels at a similar distance; needed if there is only one sub-frame.
layout(binding = 8) uniform sampler2D openness;
layout(location = 0) out vec2 result;

void main() {
  ivec2 p = ivec2(gl_FragCoord.xy), last = textureSize(openness, 0) - 1;
  vec2 here = texelFetch(openness, p, 0).rg;
  float sum = 0.0, weights = 0.0;
  // Not a constant, so that the loop is not unrolled, which would take long to compile.
  int count = here.y > 0.0 ? 9 : 0, k = 0;
  do {
    vec2 texel = texelFetch(openness, clamp(p + ivec2(k % 3 - 1, k / 3 - 1), ivec2(0), last), 0).rg;
    float off = texel.y / here.y - 1.0, weight = 1.0 / (1.0 + 1e4 * off * off);
    sum += weight * texel.x;
    weights += weight;
  } while (++k < count);
  result = vec2(sum / max(weights, 1e-6), here.y);
}
