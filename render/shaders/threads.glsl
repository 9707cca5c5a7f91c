// Threads of fabrics. WEAVE is the number of the enumerator.
struct Threads {
  float shade;  // factor of the colour: darker between threads
  vec2 slope;   // gradient of the height, along the cloth
};

// `uv` in metres along the weft and the warp.
Threads threads(vec2 uv) {
  Threads result = Threads(1.0, vec2(0.0));
#if WEAVE > 0
  float width = material.surface.z, relief = material.surface.w;
  vec2 p = uv / width, dx = dFdx(p), dy = dFdy(p);
  float footprint = sqrt(max(dot(dx, dx), dot(dy, dy)));
  float near = visible(footprint, 1.0);
  vec2 cell = floor(p), f = p - cell - 0.5;
#if WEAVE == 1  // plain: one over, one under
  bool warp = mod(cell.x + cell.y, 2.0) < 0.5;
#elif WEAVE == 2  // twill: three over, one under, shifted by one
  bool warp = mod(cell.x + cell.y, 4.0) > 0.5;
#else  // satin: four over, one under, shifted by two
  bool warp = mod(cell.x + 2.0 * cell.y, 5.0) > 0.5;
#endif
  // A round thread across its direction, which dips under its neighbours at both ends of a float.
  float across = warp ? f.x : f.y, along = warp ? f.y : f.x, far = 4.0 * across * across;
  vec2 dip = vec2(across, 0.6 * along) * (-1.8 * relief * near);
  result.slope = warp ? dip : dip.yx;
  result.shade = 1.0 + 0.55 * relief * near * (0.2 - far * far);
  // Threads vary along their length, by patches that are large enough to remain visible at a larger footprint.
  vec2 slub = vec2(noise(p * vec2(0.5, 0.03), 21u).x, noise(p * vec2(0.03, 0.5), 22u).x) - 0.5;
  result.shade *= 1.0 + 0.22 * relief * (warp ? slub.x : slub.y) * near +
                  0.10 * relief * (slub.x + slub.y) * (1.0 - near) * visible(footprint, 3.0);
#endif
  return result;
}
