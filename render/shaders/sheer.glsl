// Translucent cloth. `uv` is the position along it in metres.

// Fibres that are seen at an angle cover more.
float cover_of(float opacity, float cosine) { return 1.0 - pow(1.0 - opacity, 1.0 / max(cosine, 0.1)); }

// Start of the dither in [0, 1) at a point of the cloth, so that layers behind each other have holes at different
// places.
float hole(vec2 uv) {
  return dither(gl_FragCoord.xy, frame.sun_direction.w + dot(uv, vec2(0.5, 0.8)) + (gl_FrontFacing ? 0.0 : 0.5));
}

// Returns alpha at a point in one of n sub-frames: the fraction of the interval [first, first + 1 / n) that is below `cover`.
// The intervals of all sub-frames fill [0, 1), so the mean of alpha is the cover. Most values are 0 or 1, so the order of
// layers hardly matters.
float alpha_of(float cover, vec2 uv) {
  float n = uniforms.air.z, first = hole(uv), past = first + 1.0 / n - 1.0;  // an interval that exceeds 1 continues from 0
  return n * (clamp(cover - first, 0.0, 1.0 / n) + max(min(cover, past), 0.0));
}
