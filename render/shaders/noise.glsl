// Noise, and filters that prevent procedural detail from flickering: every detail fades to its mean before it gets
// smaller than a pixel.
uint mix_bits(uint h) {
  h = (h ^ (h >> 15)) * 0x2C1B3C6Du;
  h = (h ^ (h >> 12)) * 0x297A2D39u;
  return h ^ (h >> 15);
}

// A random number in [0, 1).
float unit_of(uint bits) { return float(mix_bits(bits) >> 8) * (1.0 / 16777216.0); }

const uvec2 kPrimes = uvec2(0x9E3779B1u, 0x85EBCA77u);
float cell_random(vec2 cell, uint salt) {
  uvec2 c = uvec2(ivec2(cell)) * kPrimes;
  return unit_of(c.x ^ c.y ^ salt);
}
// Random numbers of the cell, and of the next cells along x, y and both. The cost is in the integer multiplications.
vec4 cells_random(vec2 cell, uint salt) {
  uvec2 c = uvec2(ivec2(cell)) * kPrimes, d = c + kPrimes;
  return vec4(unit_of(c.x ^ c.y ^ salt), unit_of(d.x ^ c.y ^ salt), unit_of(c.x ^ d.y ^ salt), unit_of(d.x ^ d.y ^ salt));
}

// Value noise in [0, 1] and its gradient.
vec3 noise(vec2 p, uint salt) {
  vec2 cell = floor(p), f = p - cell;
  vec2 s = f * f * (3.0 - 2.0 * f), ds = 6.0 * f * (1.0 - f);
  vec4 r = cells_random(cell, salt);
  float a = r.x, b = r.y, c = r.z, d = r.w;
  float k = a - b - c + d;
  return vec3(a + (b - a) * s.x + (c - a) * s.y + k * s.x * s.y, ds * vec2(b - a + k * s.y, c - a + k * s.x));
}

float noise(vec3 p) {
  vec3 cell = floor(p), f = p - cell;
  vec3 s = f * f * (3.0 - 2.0 * f);
  uint z = uint(int(cell.z));
  uint salt0 = z * 0xC2B2AE3Du, salt1 = (z + 1u) * 0xC2B2AE3Du;
  vec4 c = mix(cells_random(cell.xy, salt0), cells_random(cell.xy, salt1), s.z);
  return mix(mix(c.x, c.y, s.x), mix(c.z, c.w, s.x), s.y);
}

// 1 while a detail of this size is larger than the pixel's footprint, 0 when it is much smaller.
float visible(float footprint, float size) { return 1.0 - smoothstep(0.2, 0.7, footprint / size); }

// Returns the fraction of a box of width w around p in which a square wave of period 2 is high. At the border of a cloth w can
// be 0. The difference would then be mostly a rounding error, and a fraction outside of [0, 1] would make colours negative.
vec2 square_wave(vec2 p, vec2 w) {
  w = max(w, 1e-3);
  return clamp(0.5 + (abs(fract((p - 0.5 * w) * 0.5) - 0.5) - abs(fract((p + 0.5 * w) * 0.5) - 0.5)) / w, 0.0, 1.0);
}
