// Procedural surfaces in object space. PATTERN is the number of the enumerator. Every detail fades to its mean before
// it gets smaller than a pixel, so nothing flickers in the distance.
struct PatternSample {
  vec3 color;
  float roughness;  // factor
  vec3 slope;       // gradient of the surface's height, along the object's axes
};

// A point of bricks or slabs in rows.
struct Masonry {
  vec2 cell;
  float stone;  // 0 in the joint, 1 on the stone
  vec2 slope;   // slope of the rounded edge
};

// `size`: width and height of a brick [m]; `joint`: half the width of a joint [m].
Masonry masonry(vec2 p, vec2 size, float joint, float shift_per_row, float rounding, float footprint) {
  float row = floor(p.y / size.y);
  float shift = shift_per_row == 0.0 ? cell_random(vec2(row, 7.0), 11u) : shift_per_row * mod(row, 2.0);
  float column = p.x / size.x + shift;
  Masonry m;
  m.cell = vec2(floor(column), row);
  vec2 f = vec2((fract(column) - 0.5) * size.x, p.y - (row + 0.5) * size.y);
  vec2 inside = 0.5 * size - abs(f) - joint;  // distance to the joint
  float d = min(inside.x, inside.y);
  float soft = 0.5 * rounding + 0.5 * footprint;
  float mean = (1.0 - 2.0 * joint / size.x) * (1.0 - 2.0 * joint / size.y);
  float near = visible(footprint, size.y);
  m.stone = mix(mean, smoothstep(-soft, soft, d), near);
  float edge = saturate(1.0 - d / rounding) * smoothstep(-soft, soft, d) * visible(footprint, 2.0 * rounding);
  m.slope = -0.6 * edge * sign(f) * (inside.x < inside.y ? vec2(1.0, 0.0) : vec2(0.0, 1.0));
  return m;
}

PatternSample pattern_sample(vec3 p, vec3 n) {
  vec3 a = material.color.rgb, b = material.pattern_color.rgb;
  float scale = material.pattern_color.w;
  vec3 dx = dFdx(p), dy = dFdy(p);
  float footprint = 0.8 * sqrt(sqrt(dot(dx, dx) * dot(dy, dy)));  // mean of its length and width
  PatternSample result = PatternSample(a, 1.0, vec3(0.0));

#if PATTERN == 3 || PATTERN == 5
  vec3 q = p / scale;
  float w = footprint / scale;
#endif
#if PATTERN == 3  // noise: four octaves
  float sum = 0.5, amplitude = 0.5;
  for (int octave = 0; octave < 4; ++octave) {
    sum += amplitude * visible(w, 1.0) * (noise(q) - 0.5);
    q = q.yzx * 2.03 + 17.3;
    w *= 2.03;
    amplitude *= 0.5;
  }
  result.color = mix(a, b, smoothstep(0.2, 0.8, sum));
  result.roughness = 0.85 + 0.3 * sum;
#elif PATTERN == 5  // wood: year rings about an axis along x, bent by noise, and fibres
  float bend = mix(0.5, noise(q * vec3(0.35, 1.1, 1.1) + 5.0), visible(w, 0.9));
  float radius = 9.0 * length(q.yz + vec2(0.9, 0.6)) + 2.6 * bend;
  float ring = fract(radius);
  float late = smoothstep(0.1, 0.8, ring) * (1.0 - smoothstep(0.88, 1.0, ring));
  late = mix(0.45, late, visible(w, 0.2));
  float fibre = mix(0.5, noise(q * vec3(3.0, 70.0, 70.0)), visible(w, 1.0 / 70.0));
  float tone = 0.1 + 0.5 * late + 0.6 * (fibre - 0.5) + 0.3 * (bend - 0.5);
  result.color = mix(a, b, saturate(tone));
  result.roughness = 0.9 + 0.25 * late;
#else
  // The other patterns use the plane that is closest to the surface's orientation.
  vec3 size = abs(n);
  bool level = size.y >= max(size.x, size.z), facing_x = !level && size.x > size.z;
  vec3 u = facing_x ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0), v = level ? vec3(0.0, 0.0, 1.0) : vec3(0.0, 1.0, 0.0);
  vec2 q = vec2(dot(p, u), dot(p, v));
  vec2 w = max(abs(vec2(dot(dx, u), dot(dx, v))), abs(vec2(dot(dy, u), dot(dy, v)))) + 1e-5 * scale;
  vec2 slope = vec2(0.0);

#if PATTERN == 1 || PATTERN == 2 || PATTERN == 8 || PATTERN == 9  // checker, grid, stripes, gingham
  float broad = (noise(q / scale * 0.63, 1u).x - 0.5) * visible(footprint, 1.6 * scale);
  float fine = (noise(q / scale * 9.0, 2u).x - 0.5) * visible(footprint, scale / 9.0);
#if PATTERN == 1
  vec2 wave = square_wave(q / scale, w / scale);
  result.color = mix(a, b, wave.x + wave.y - 2.0 * wave.x * wave.y);
#elif PATTERN == 8  // stripes
  result.color = mix(a, b, square_wave(q / scale, w / scale).x);
#elif PATTERN == 9  // gingham: stripes along both axes, half as strong where only one of them is
  vec2 wave = square_wave(q / scale, w / scale);
  result.color = mix(a, b, 0.5 * (wave.x + wave.y));
#else
  const float kLine = 0.03;
  vec2 k = q / scale + 0.5 * kLine, e0 = k - 0.5 * w / scale, e1 = k + 0.5 * w / scale;
  vec2 line = ((floor(e1) * kLine + min(fract(e1), kLine)) - (floor(e0) * kLine + min(fract(e0), kLine))) / (e1 - e0);
  result.color = mix(a, b, line.x + line.y - line.x * line.y);
#endif
  result.color *= 1.0 + 0.10 * broad + 0.07 * fine;
  result.roughness = 1.0 + 0.35 * broad + 0.15 * fine;

#elif PATTERN == 4  // brick
  vec2 brick = vec2(scale, 0.3 * scale);
  Masonry m = masonry(q, brick, 0.022 * scale, 0.5, 0.03 * scale, footprint);
  float near = visible(footprint, brick.y);
  float tint = (cell_random(m.cell, 3u) - 0.5) * near, hue = (cell_random(m.cell, 4u) - 0.5) * near;
  vec3 mottle = (noise(q * (11.0 / scale), 5u) - vec3(0.5, 0.0, 0.0)) * visible(footprint, scale / 11.0);
  vec3 grain = (noise(q * (41.0 / scale), 6u) - vec3(0.5, 0.0, 0.0)) * visible(footprint, scale / 41.0);
  vec3 stone = a * (1.0 + 0.5 * tint + 0.35 * mottle.x + 0.25 * grain.x) * (1.0 + vec3(0.12, 0.0, -0.1) * hue);
  result.color = mix(b * (1.0 + 0.25 * grain.x + 0.2 * mottle.x), stone, m.stone);
  result.roughness = mix(1.25, 1.0 + 0.3 * mottle.x, m.stone);
  slope = m.slope + 0.10 * mottle.yz + 0.12 * grain.yz;

#elif PATTERN == 6  // lawn: patches, clumps, blades, and the mower's lanes
  float broad = (noise(q / scale * 0.37, 7u).x - 0.5) * visible(footprint, 2.7 * scale);
  vec3 clump = (noise(q / scale * 2.3, 8u) - vec3(0.5, 0.0, 0.0)) * visible(footprint, scale / 2.3);
  vec2 turned = mat2(0.8, 0.6, -0.6, 0.8) * q;
  vec3 blade = (noise(q / scale * vec2(90.0, 23.0), 9u) - vec3(0.5, 0.0, 0.0)) * visible(footprint, scale / 60.0);
  vec3 blade2 = (noise(turned / scale * vec2(21.0, 110.0), 10u) - vec3(0.5, 0.0, 0.0)) * visible(footprint, scale / 60.0);
  float tuft = (noise(turned / scale * vec2(9.0, 13.0), 18u).x - 0.5) * visible(footprint, scale / 11.0);
  float lane = abs(fract(q.x / (6.0 * scale)) * 2.0 - 1.0);
  lane = (smoothstep(0.42, 0.58, lane) - 0.5) * visible(footprint, 3.0 * scale);
  float tone = 0.5 + 0.9 * broad + 0.7 * clump.x + 0.7 * tuft + 0.5 * (blade.x + blade2.x);
  float shade = 1.0 + 0.14 * lane + 0.25 * clump.x + 0.45 * tuft + 0.7 * (blade.x + blade2.x);
  result.color = mix(a, b, saturate(tone)) * max(shade, 0.25);
  slope = 0.2 * clump.yz + 0.3 * (blade.yz + blade2.yz);

#elif PATTERN == 10  // concrete: blotches, pores, and the joints of its shuttering
  float broad = (noise(q / scale * 0.7, 23u).x - 0.5) * visible(footprint, scale / 0.7);
  float cloud = (noise(q / scale * 2.9, 24u).x - 0.5) * visible(footprint, scale / 2.9);
  vec3 grain = (noise(q / scale * 47.0, 25u) - vec3(0.5, 0.0, 0.0)) * visible(footprint, scale / 47.0);
  float pore = smoothstep(0.80, 0.95, noise(q / scale * 29.0, 26u).x) * visible(footprint, scale / 40.0);
  Masonry m = masonry(q, vec2(4.0 * scale, 2.0 * scale), 0.006 * scale, 0.0, 0.012 * scale, footprint);
  float tone = 1.0 + 0.16 * broad + 0.14 * cloud + 0.07 * grain.x;
  result.color = mix(b, a * tone * (1.0 + 0.06 * (cell_random(m.cell, 27u) - 0.5)), m.stone) * (1.0 - 0.35 * pore);
  result.roughness = 1.0 + 0.3 * cloud;
  slope = m.slope + 0.05 * grain.yz;

#elif PATTERN == 11  // sand: ripples that branch, and grains
  vec3 bend = (noise(q / scale * 0.45, 28u) - vec3(0.5, 0.0, 0.0)) * visible(footprint, scale / 0.45);
  float phase = 6.2831853 * (q.y / scale * 2.2 + 2.4 * bend.x + 0.3 * q.x / scale), ridge = visible(footprint, 0.45 * scale);
  vec3 grain = (noise(q / scale * 83.0, 29u) - vec3(0.5, 0.0, 0.0)) * visible(footprint, scale / 83.0);
  float broad = (noise(q / scale * 0.21, 30u).x - 0.5) * visible(footprint, scale / 0.21);
  float high = 0.5 + 0.5 * sin(phase);
  result.color = mix(b, a, saturate(0.5 + 0.35 * (high - 0.5) * ridge + 0.8 * broad)) * (1.0 + 0.22 * grain.x);
  slope = 0.16 * grain.yz + ridge * 0.22 * cos(phase) * vec2(0.13, 1.0);

#elif PATTERN == 12  // planks: boards of wood side by side
  Masonry m = masonry(q, vec2(9.0 * scale, scale), 0.01 * scale, 0.0, 0.02 * scale, footprint);
  float tint = cell_random(m.cell, 31u) - 0.5, shift = 50.0 * cell_random(m.cell, 32u);
  vec2 along = vec2(q.x * 0.5, q.y * 5.0) / scale + shift;
  float wave = noise(along, 33u).x, rings = fract(4.0 * noise(along * vec2(0.6, 0.7), 34u).x + 0.5 * wave);
  float late = smoothstep(0.2, 0.8, rings) * (1.0 - smoothstep(0.9, 1.0, rings));
  late = mix(0.45, late, visible(footprint, 0.08 * scale));
  float fibre = (noise(along * vec2(3.0, 9.0), 35u).x - 0.5) * visible(footprint, 0.02 * scale);
  vec3 wood = mix(a, b, saturate(0.12 + 0.45 * late + 0.45 * fibre + 0.35 * tint)) * (1.0 + 0.25 * tint);
  result.color = mix(0.25 * b, wood, m.stone);
  result.roughness = 1.0 + 0.2 * late + 0.2 * fibre;
  slope = m.slope;

#elif PATTERN == 13  // water: ripples of several lengths that run in their directions
  float t = uniforms.air.x;
  vec2 r = q / scale, turned = mat2(0.8, 0.6, -0.6, 0.8) * r;
  vec3 n1 = noise(r * 1.3 + t * vec2(0.7, 0.2), 36u), n2 = noise(turned * 2.9 - t * vec2(0.5, 0.9), 37u);
  vec3 n3 = noise(r * 6.1 + t * vec2(-1.3, 0.8), 38u);
  slope = 0.09 * n1.yz * visible(footprint, scale / 1.3) + 0.07 * n2.yz * visible(footprint, scale / 2.9) +
          0.05 * n3.yz * visible(footprint, scale / 6.1);
  result.color = mix(a, b, 0.3 * (n1.x + n2.x - 1.0) + 0.3);

#else  // paving
  Masonry m = masonry(q, vec2(1.45 * scale, scale), 0.012 * scale, 0.0, 0.025 * scale, footprint);
  float near = visible(footprint, scale);
  float tint = (cell_random(m.cell, 12u) - 0.5) * near;
  vec2 tilt = (vec2(cell_random(m.cell, 13u), cell_random(m.cell, 14u)) - 0.5) * near;
  float broad = (noise(q / scale * 0.8, 15u).x - 0.5) * visible(footprint, scale / 0.8);
  vec3 mottle = (noise(q / scale * 5.0, 16u) - vec3(0.5, 0.0, 0.0)) * visible(footprint, scale / 5.0);
  vec3 grain = (noise(q / scale * 37.0, 17u) - vec3(0.5, 0.0, 0.0)) * visible(footprint, scale / 37.0);
  vec3 stone = a * (1.0 + 0.34 * tint + 0.2 * broad + 0.2 * mottle.x + 0.22 * grain.x) *
               (1.0 + vec3(0.06, 0.0, -0.06) * (tint + mottle.x));
  result.color = mix(b * (1.0 + 0.4 * grain.x), stone, m.stone);
  result.roughness = mix(1.6, 1.0 + 0.5 * broad + 0.35 * mottle.x + 0.3 * tint, m.stone);
  float dry = mix(0.3, 1.0, material.surface.y);  // water stays smooth in the small hollows
  slope = m.slope + dry * (0.02 * tilt + 0.02 * mottle.yz + 0.03 * grain.yz);
#endif
  result.slope = u * slope.x + v * slope.y;
#endif
  return result;
}
