// Noise and what keeps procedural detail from sparkling: every detail fades to its mean before it gets smaller than a
// pixel.
uint mix_bits(uint h) {
  h = (h ^ (h >> 15)) * 0x2C1B3C6Du;
  h = (h ^ (h >> 12)) * 0x297A2D39u;
  return h ^ (h >> 15);
}

// In [0, 1).
float cell_random(vec2 cell, uint salt) {
  uvec2 c = uvec2(ivec2(cell));
  return float(mix_bits(c.x * 0x9E3779B1u ^ c.y * 0x85EBCA77u ^ salt) >> 8) * (1.0 / 16777216.0);
}

// Value noise in [0, 1] and its gradient.
vec3 noise(vec2 p, uint salt) {
  vec2 cell = floor(p), f = p - cell;
  vec2 s = f * f * (3.0 - 2.0 * f), ds = 6.0 * f * (1.0 - f);
  float a = cell_random(cell, salt), b = cell_random(cell + vec2(1.0, 0.0), salt);
  float c = cell_random(cell + vec2(0.0, 1.0), salt), d = cell_random(cell + vec2(1.0, 1.0), salt);
  float k = a - b - c + d;
  return vec3(a + (b - a) * s.x + (c - a) * s.y + k * s.x * s.y, ds * vec2(b - a + k * s.y, c - a + k * s.x));
}

float noise(vec3 p) {
  vec3 cell = floor(p), f = p - cell;
  vec3 s = f * f * (3.0 - 2.0 * f);
  uint z = uint(int(cell.z));
  uint salt0 = z * 0xC2B2AE3Du, salt1 = (z + 1u) * 0xC2B2AE3Du;
  vec2 x = vec2(1.0, 0.0);
  vec4 low = vec4(cell_random(cell.xy, salt0), cell_random(cell.xy + x, salt0), cell_random(cell.xy + x.yx, salt0),
                  cell_random(cell.xy + x.xx, salt0));
  vec4 high = vec4(cell_random(cell.xy, salt1), cell_random(cell.xy + x, salt1), cell_random(cell.xy + x.yx, salt1),
                   cell_random(cell.xy + x.xx, salt1));
  vec4 c = mix(low, high, s.z);
  return mix(mix(c.x, c.y, s.x), mix(c.z, c.w, s.x), s.y);
}

// 1 while a detail of this size is well above the pixel's footprint, 0 when it drowns in it.
float visible(float footprint, float size) { return 1.0 - smoothstep(0.2, 0.7, footprint / size); }

// The share of a box of width w around p in which a square wave of period 2 is up.
vec2 square_wave(vec2 p, vec2 w) {
  return 0.5 + (abs(fract((p - 0.5 * w) * 0.5) - 0.5) - abs(fract((p + 0.5 * w) * 0.5) - 0.5)) / w;
}
