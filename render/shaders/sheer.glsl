// Translucent cloth. `uv` is the position along it in metres.

// Fibres that are seen at an angle cover more.
float cover_of(float opacity, float cosine) { return 1.0 - pow(1.0 - opacity, 1.0 / max(cosine, 0.1)); }

// Start of the dither in [0, 1) at a point of the cloth, so that layers behind each other have holes at different
// places.
float hole(vec2 uv) {
  return dither(gl_FragCoord.xy, frame.sun_direction.w + dot(uv, vec2(0.5, 0.8)) + (gl_FrontFacing ? 0.0 : 0.5));
}

// Alpha at a point in one of n sub-frames: the part of the cover [0, cover) in the sub-frame's n-th of [0, 1). Most
// values are 0 or 1, so the order of layers hardly matters; the mean over all sub-frames is the cover.
float alpha_of(float cover, vec2 uv) {
  float n = uniforms.air.z, first = hole(uv), past = first + 1.0 / n - 1.0;  // the last one continues from 0
  return n * (clamp(cover - first, 0.0, 1.0 / n) + max(min(cover, past), 0.0));
}
