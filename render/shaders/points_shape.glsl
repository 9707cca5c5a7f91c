// Fraction of a pixel that a particle covers, from the position on its quad (see points.vert).
float coverage(vec3 place, float softness) {
  vec2 from_axis = vec2(place.x, place.y - clamp(place.y, -place.z, place.z));
  return 1.0 - smoothstep(1.0 - softness, 1.0, length(from_axis));
}
