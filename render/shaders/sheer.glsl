// Cloth that is not wholly opaque. `uv` along it in metres.

// Fibres that are seen aslant cover more.
float cover_of(float opacity, float cosine) { return 1.0 - pow(1.0 - opacity, 1.0 / max(cosine, 0.1)); }

// Where in [0, 1) the dither of a place of the cloth begins: layers behind each other have their holes elsewhere.
float hole(vec2 uv) {
  return dither(gl_FragCoord.xy, frame.shadow.w + dot(uv, vec2(0.5, 0.8)) + (gl_FrontFacing ? 0.0 : 0.5));
}

// The alpha of a place in one of n sub-frames: what the cover [0, cover) takes of the n-th of [0, 1) that is this one's
// turn. Most are 0 or 1, so the order of layers hardly matters; all together they are the cover.
float alpha_of(float cover, vec2 uv) {
  float n = uniforms.air.w, first = hole(uv), past = first + 1.0 / n - 1.0;  // the last one goes on from 0
  return n * (clamp(cover - first, 0.0, 1.0 / n) + max(min(cover, past), 0.0));
}
