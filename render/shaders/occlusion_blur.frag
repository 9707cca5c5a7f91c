// The mean over three by three texels that are as far away: what one sub-frame alone needs.
layout(binding = 8) uniform sampler2D openness;
layout(location = 0) out vec2 result;

void main() {
  ivec2 p = ivec2(gl_FragCoord.xy), last = textureSize(openness, 0) - 1;
  vec2 here = texelFetch(openness, p, 0).rg;
  float sum = 0.0, weights = 0.0;
  int count = here.y > 0.0 ? 9 : 0, k = 0;  // not a constant: the loop must not be unrolled, for compilation takes time
  do {
    vec2 texel = texelFetch(openness, clamp(p + ivec2(k % 3 - 1, k / 3 - 1), ivec2(0), last), 0).rg;
    float off = texel.y / here.y - 1.0, weight = 1.0 / (1.0 + 1e4 * off * off);
    sum += weight * texel.x;
    weights += weight;
  } while (++k < count);
  result = vec2(sum / max(weights, 1e-6), here.y);
}
