// Writes the data of a visible surface from which its light is traced, instead of its colour.
layout(location = 0) out vec4 surface_place;    // position; w: roughness, + 2 if it mirrors, + 4 on cloth, + 8 if it is metal
layout(location = 1) out vec4 surface_normals;  // smooth normal, normal of the triangle
layout(location = 2) out vec4 surface_color;    // only in quick pictures; see plain.frag
#ifdef LAYER
layout(binding = 28) uniform sampler2D depth_behind;  // depth of the objects behind this layer of a translucent body
#endif

vec2 octahedral(vec3 n) {
  n /= abs(n.x) + abs(n.y) + abs(n.z);
  vec2 p = n.y >= 0.0 ? n.xz : (1.0 - abs(n.zx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.z < 0.0 ? -1.0 : 1.0);
  return 0.5 + 0.5 * p;
}

// `face`: any vector along the normal of the triangle.
void write_surface(vec3 place, vec3 n, vec3 face, vec3 view, float kind) {
  face *= dot(face, view) < 0.0 ? -1.0 : 1.0;
  float size = dot(face, face);
  face = size > 1e-30 ? face * inversesqrt(size) : n;
  surface_place = vec4(place, kind);
  surface_normals = vec4(octahedral(n), octahedral(face));
  surface_color = vec4(0.0);
#ifdef LAYER
  // The layer behind has this depth, which must not exceed itself by rounding.
  if (gl_FragCoord.z <= 1.000001 * texelFetch(depth_behind, ivec2(gl_FragCoord.xy), 0).r) discard;
#endif
}
