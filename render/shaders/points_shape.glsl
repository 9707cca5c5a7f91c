// Share of a pixel that a particle covers, from the place on its quad.
float coverage(vec2 across, float softness) {
  return 1.0 - smoothstep(1.0 - softness, 1.0, length(across));
}

#if STYLE == 1
// Of a streak: the place relative to the nearest point of its axis.
vec2 from_axis(float x, float along, float half_length) {
  return vec2(x, along - clamp(along, -half_length, half_length));
}
#endif
