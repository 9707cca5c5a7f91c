// Shadow map and shading of opaque surfaces.
layout(binding = 0) uniform sampler2DShadow shadow_map;

struct Surface {
  vec3 albedo;
  float roughness;
  float metallic;
  vec3 emission;
};

// Share of the sun's light that arrives. A tent of 3x3 texels in four fetches (I. Castano, "Shadow Mapping Summary",
// 2013). The point is moved off its surface by about a texel, more where the light grazes, which keeps a surface from
// shadowing itself without detaching shadows from their casters.
float shadow_map_visibility(vec3 position, vec3 normal) {
  if (frame.sun_direction.w == 0.0) return 1.0;
  float cosine = saturate(dot(normal, frame.sun_direction.xyz));
  vec3 moved = position + frame.shadow.x * (normal * (2.2 * sqrt(1.0 - cosine * cosine) + 0.3) + 0.7 * frame.sun_direction.xyz);
  vec3 p = (frame.shadow_from_world * vec4(moved, 1.0)).xyz;
  if (any(notEqual(p.xy, clamp(p.xy, 0.0, 1.0)))) return 1.0;
  p.z = saturate(p.z);
  if (frame.horizon.w != 0.0) return texture(shadow_map, p);  // the mean over the sub-frames is filter enough

  vec2 texel = p.xy * frame.shadow.y;
  vec2 base = floor(texel + 0.5);
  vec2 f = texel + 0.5 - base;
  base = (base - 0.5) * frame.shadow.z;
  vec2 w0 = 3.0 - 2.0 * f, w1 = 1.0 + 2.0 * f;
  vec2 o0 = ((2.0 - f) / w0 - 1.0) * frame.shadow.z, o1 = (f / w1 + 1.0) * frame.shadow.z;
  float sum = w0.x * w0.y * texture(shadow_map, vec3(base + o0, p.z)) +
              w1.x * w0.y * texture(shadow_map, vec3(base + vec2(o1.x, o0.y), p.z)) +
              w0.x * w1.y * texture(shadow_map, vec3(base + vec2(o0.x, o1.y), p.z)) +
              w1.x * w1.y * texture(shadow_map, vec3(base + o1, p.z));
  return sum * (1.0 / 16.0);
}

#ifdef SMOKE
layout(binding = 5) uniform sampler3D smoke_depth;
#endif

// The same through smoke.
float sun_visibility(vec3 position, vec3 normal) {
  float visibility = shadow_map_visibility(position, normal);
#ifdef SMOKE
  visibility *= exp(-texture(smoke_depth, (frame.smoke_from_world * vec4(position, 1.0)).xyz).r);
#endif
  return visibility;
}

// GGX with the visibility term of E. Hammon (2017), times pi.
float sun_lobe(float a, float nl, float nv, float nh) {
  float a2 = a * a;
  float d = nh * nh * (a2 - 1.0) + 1.0;
  float lobe = a2 / (d * d) * 0.5 / mix(2.0 * nl * nv, nl + nv, a);
  return min(lobe, 40.0);
}
float sun_roughness(float roughness) { return max(roughness * roughness, 0.5 * frame.sun_radiance.w + 0.002); }

vec3 fresnel_at(vec3 f0, float vh) {
  float m = 1.0 - vh, m2 = m * m;
  return f0 + (1.0 - f0) * (m2 * m2 * m);
}

// The split sum of B. Karis, "Physically Based Shading on Mobile" (2014).
vec3 sky_reflectance(vec3 f0, float roughness, float nv) {
  vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
  float t = min(r.x * r.x, exp2(-9.28 * nv)) * r.x + r.y;
  return f0 * (-1.04 * t + r.z) + (1.04 * t + r.w);
}

// The sun's light and the sky's that a surface sends to the eye; `view` points to it.
vec3 shade(Surface s, vec3 normal, vec3 view, float visibility) {
  vec3 l = frame.sun_direction.xyz;
  vec3 h = normalize(l + view);
  float nl = saturate(dot(normal, l)), nv = max(abs(dot(normal, view)), 1e-3);
  float nh = saturate(dot(normal, h)), vh = saturate(dot(view, h));

  vec3 f0 = mix(vec3(0.04), s.albedo, s.metallic);
  vec3 fresnel = fresnel_at(f0, vh);
  float lobe = sun_lobe(sun_roughness(s.roughness), nl, nv, nh);
  vec3 diffuse = s.albedo * (1.0 - s.metallic);
  vec3 sun = frame.sun_radiance.rgb * (nl * visibility) * (diffuse * (1.0 - fresnel) + lobe * fresnel);

  vec3 reflectance = sky_reflectance(f0, s.roughness, nv);
  vec3 sky = ambient(normal) * diffuse * (1.0 - reflectance) +
             sky_reflection(reflect(-view, normal), s.roughness) * reflectance;
  return sun + sky + s.emission;
}
