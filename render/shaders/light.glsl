// Shading of surfaces in light that is known.

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
  float sun;      // fraction of the sun that is visible
  vec3 around;    // radiance of a white surface in the light of the sky and of other surfaces
  vec3 lamps;     // radiance of a white surface in the light of lamps
  float open;     // fraction of the sky's light that arrives
  vec4 mirrored;  // light from the mirrored direction; w: 1 if known, else the sky is mirrored
};

// Light from the mirrored direction. If the mirror image was not traced, the surface reflects the visible part of the sky.
// With increasing roughness this changes to the light from all directions.
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
