// Reflections of the scene in a smooth surface, searched along the ray in the finished picture of the opaque objects
// (after M. McGuire and M. Mara, "Efficient GPU Screen-Space Ray Tracing", 2014). Objects that are outside of the
// picture or hidden in it are not found; the sky is reflected there.
layout(binding = 4) uniform sampler2D scene_depth;
layout(binding = 12) uniform sampler2D behind;
layout(location = 2) uniform vec2 search;  // length of the ray [m], steps

float scene_distance(vec2 place) { return uniforms.depth.x / (textureLod(scene_depth, place, 0.0).r + uniforms.depth.y); }

// Light, and the share of it that was found.
vec4 seen_in_mirror(vec3 position, vec3 n, vec3 view, float roughness) {
  // Rough surfaces spread the ray; each pixel and sub-frame takes one of its directions.
  float turn = 6.2831853 * dither(gl_FragCoord.xy, frame.shadow.w + 0.17), off = dither(gl_FragCoord.yx, 0.61 - frame.shadow.w);
  vec3 ray = reflect(-view, n), side = normalize(cross(ray, abs(ray.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0)));
  float spread = 0.5 * roughness * roughness * sqrt(off);
  ray = normalize(ray + spread * (cos(turn) * side + sin(turn) * cross(ray, side)));
  if (dot(ray, n) <= 0.02) ray = reflect(-view, n);
  vec4 from = uniforms.clip_from_world * vec4(position, 1.0), way = uniforms.clip_from_world * vec4(ray, 0.0) * search.x;
  // Up to the near plane and the edge of the picture.
  float end = way.w < 0.0 ? min(1.0, 0.9 * from.w / -way.w) : 1.0;
  // Depth of the surface itself decreases by this much per pixel.
  float slope = 1.5 * fwidth(from.w);
  int steps = int(search.y);
  float before = 0.0, hit = 0.0, share = (0.4 + 0.6 * off) / search.y;
  for (int k = 0; k < steps; ++k) {
    float t = end * share * share;  // short steps first
    vec4 p = from + t * way;
    vec2 place = 0.5 + 0.5 * p.xy / p.w;
    float behind_by = p.w - scene_distance(place);
    bool inside = place == clamp(place, 0.0, 1.0);
    // The assumed thickness is the ray's progress in a step, and a little more.
    float least = 0.002 * p.w + slope, thick = abs(way.w) * (t - before) + 0.03 * p.w;
    if (inside && behind_by > least && behind_by < least + thick) hit = t;
    if (hit > 0.0 || !inside) steps = 0;
    else before = t;
    share += 1.0 / search.y;
  }
  // Bisection between the last point in front and the first point behind.
  float low = before, high = hit;
  int halvings = hit > 0.0 ? 5 : 0;
  for (int k = 0; k < halvings; ++k) {
    float t = 0.5 * (low + high);
    vec4 p = from + t * way;
    if (p.w > scene_distance(0.5 + 0.5 * p.xy / p.w)) high = t;
    else low = t;
  }
  vec4 p = from + high * way;
  vec2 place = 0.5 + 0.5 * p.xy / p.w, edge = abs(place - 0.5);
  // Where the ray entered behind an edge, there is no surface.
  float off_surface = p.w - scene_distance(place) - slope;
  float found = (hit > 0.0 && off_surface < 0.02 * p.w ? 1.0 : 0.0) * (1.0 - smoothstep(0.42, 0.5, max(edge.x, edge.y))) * (1.0 - smoothstep(0.25, 0.45, roughness));
  return vec4(min(textureLod(behind, clamp(place, 0.0, 1.0), 0.0).rgb, vec3(8.0)), found);
}
