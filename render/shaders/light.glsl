// Shadow map, openness to the sky, and shading of opaque surfaces.
layout(binding = 0) uniform sampler2DShadow shadow_map;

// Reflectance of a dielectric that faces the eye.
#if defined(DETAILED) && defined(FRAGMENT)
vec3 dielectric_f0 = vec3(0.04);
#else
#define dielectric_f0 vec3(0.04)
#endif

struct Surface {
  vec3 albedo;
  float roughness;
  float metallic;
  vec3 emission;
};

vec3 in_shadow_map(vec4 v) { return vec3(dot(frame.shadow_rows[0], v), dot(frame.shadow_rows[1], v), dot(frame.shadow_rows[2], v)); }

// Position in the shadow map. The point is moved off its surface by about a texel, more at grazing light. This prevents
// a surface from shadowing itself without detaching shadows from their casters.
vec3 shadow_place(vec3 position, vec3 normal) {
  float cosine = saturate(dot(normal, frame.sun_direction.xyz));
  vec3 moved = position + frame.shadow.x * (normal * (2.2 * sqrt(1.0 - cosine * cosine) + 0.3) + 0.7 * frame.sun_direction.xyz);
  vec3 p = in_shadow_map(vec4(moved, 1.0));
  return vec3(p.xy, max(p.z, 0.0));
}
bool off_shadow_map(vec3 p) { return any(notEqual(p.xy, clamp(p.xy, 0.0, 1.0))); }

#ifdef FRAGMENT
layout(binding = 9) uniform sampler2D shadow_depth;  // the shadow map without comparison

// The softness of a shadow grows with the distance of its caster (R. Fernando, "Percentage-Closer Soft Shadows", 2005):
// first the mean depth of the casters is computed, then the share of a disc as wide as the penumbra. Where all samples
// agree, as almost everywhere, the first step is enough. llvmpipe runs a loop's body until no pixel of eight needs
// another round, and at least once, so these loops test their condition at the end.
float shadow_map_visibility(vec3 position, vec3 normal) {
  if (frame.sun_direction.w == 0.0) return 1.0;
  vec3 p = shadow_place(position, normal);
  if (off_shadow_map(p)) return 1.0;
  float turn = 6.2831853 * dither(gl_FragCoord.xy, frame.shadow.w);
  vec2 a = vec2(cos(turn), sin(turn));
  // Height of a sample along the surface itself.
  vec3 g = in_shadow_map(vec4(normal, 0.0));
  vec2 slope = g.xy * (frame.penumbra.z / min(g.z, -1e-9));
  float steep = inversesqrt(dot(slope, slope) + 1e-12);
  slope *= -min(1.0, 4.0 * sqrt(frame.penumbra.z) * steep);
  float beside = min(1.0 / steep, 4.0 * sqrt(frame.penumbra.z)) * frame.shadow.z;
  float search = min(frame.penumbra.x * p.z, frame.penumbra.y) + 1.0, sum = 0.0, blockers = 0.0;
  int rounds = g.z < 0.0 ? 4 : 0;  // no search where a surface faces away from the sun
  int k = 0;
  do {
    vec2 offset = a * (0.7 * search * frame.shadow.z);
    vec4 depth = textureGather(shadow_depth, p.xy + offset);
    vec4 blocks = vec4(lessThan(depth, vec4(min(p.z + dot(slope, offset) - beside, 1.0))));
    sum += dot(depth, blocks);
    blockers += dot(blocks, vec4(1.0));
    a = vec2(-a.y, a.x);
  } while (++k < rounds);
  int taps = rounds == 0 || blockers == 0.0 || blockers == 16.0 ? 0 : int(frame.penumbra.w);
  float penumbra = clamp(frame.penumbra.x * (p.z - sum / max(blockers, 1.0)), 1.0, frame.penumbra.y);
  float lit = 0.0, n = frame.penumbra.w;
  k = 0;
  do {
    vec2 offset = a * (penumbra * frame.shadow.z * sqrt((float(k) + 0.5) / n));
    lit += texture(shadow_map, vec3(p.xy + offset, min(p.z + dot(slope, offset), 1.0)));
    a = mat2(-0.73736888, -0.67549029, 0.67549029, -0.73736888) * a;  // rotation by the golden angle
  } while (++k < taps);
  return rounds == 0 || blockers == 0.0 ? 1.0 : blockers == 16.0 ? 0.0 : lit / n;
}
#else
float shadow_map_visibility(vec3 position, vec3 normal) {
  if (frame.sun_direction.w == 0.0) return 1.0;
  vec3 p = shadow_place(position, normal);
  return off_shadow_map(p) ? 1.0 : texture(shadow_map, vec3(p.xy, min(p.z, 1.0)));
}
#endif

#ifdef SMOKE
layout(binding = 5) uniform sampler3D smoke_depth;
#endif

// The same including smoke.
float sun_visibility(vec3 position, vec3 normal) {
  float visibility = shadow_map_visibility(position, normal);
#ifdef SMOKE
  visibility *= exp(-texture(smoke_depth, (uniforms.smoke_from_world * vec4(position, 1.0)).xyz).r);
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

// The split-sum approximation of B. Karis, "Physically Based Shading on Mobile" (2014).
vec3 sky_reflectance(vec3 f0, float roughness, float nv) {
  vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
  float t = min(r.x * r.x, exp2(-9.28 * nv)) * r.x + r.y;
  return f0 * (-1.04 * t + r.z) + (1.04 * t + r.w);
}

// Light that arrives at a surface.
struct Light {
  float sun;      // share of the sun that is visible
  vec3 around;    // radiance of a white surface in the light of the sky and of other surfaces
  vec3 lamps;     // radiance of a white surface in the light of lamps
  float open;     // share of the sky's light that arrives
  vec4 mirrored;  // light from the mirrored direction; w: 1 if known, else the sky is mirrored
};

// Light from the mirrored direction. A rough surface, whose mirror image was not traced, reflects the sky as far as it is
// open, and the rougher it is, the more of all the light around.
vec3 reflected_light(vec3 view, vec3 normal, float roughness, Light light) {
  float nv = max(abs(dot(normal, view)), 1e-3), open = saturate((nv + light.open) * (nv + light.open) - 1.0 + light.open);
  vec3 sky = mix(sky_reflection(reflect(-view, normal), roughness) * open, light.around, roughness * roughness);
  return mix(sky, light.mirrored.rgb, light.mirrored.w);
}

// Light of sun and sky that a surface reflects to the eye; `view` points to the eye.
vec3 shade(Surface s, vec3 normal, vec3 view, Light light) {
  vec3 l = frame.sun_direction.xyz;
  vec3 h = normalize(l + view);
  float nl = saturate(dot(normal, l)), nv = max(abs(dot(normal, view)), 1e-3);
  float nh = saturate(dot(normal, h)), vh = saturate(dot(view, h));

  vec3 f0 = mix(dielectric_f0, s.albedo, s.metallic);
  vec3 fresnel = fresnel_at(f0, vh);
  float lobe = sun_lobe(sun_roughness(s.roughness), nl, nv, nh);
  vec3 diffuse = s.albedo * (1.0 - s.metallic);
  vec3 sun = frame.sun_radiance.rgb * (nl * light.sun) * (diffuse * (1.0 - fresnel) + lobe * fresnel);

  vec3 reflectance = sky_reflectance(f0, s.roughness, nv);
  vec3 mirrored = reflected_light(view, normal, s.roughness, light);
  return sun + (light.around + light.lamps) * diffuse * (1.0 - reflectance) + mirrored * reflectance + s.emission;
}
