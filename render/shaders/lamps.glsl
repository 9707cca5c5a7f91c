// Light of lamps. Their positions change a little from sub-frame to sub-frame, within the lamp.
#ifdef LAMPS
// Radiance of a white surface that faces the lamp, and the unit vector to it.
vec3 lamp_radiance(Lamp lamp, vec3 position, out vec3 l) {
  vec3 v = lamp.position.xyz - position;
  float d2 = dot(v, v);
  l = v * inversesqrt(d2 + 1e-12);
  float share = saturate(lamp.right.w - lamp.direction.w * dot(l, lamp.direction.xyz));
  return lamp.intensity.rgb * (share / (d2 + 0.25 * lamp.position.w * lamp.position.w));
}

// Light on a particle so small that it is lit from all sides.
vec3 lamps_all_around(vec3 position) {
  vec3 sum = vec3(0.0), l;
  for (int k = 0; k < int(uniforms.air.x); ++k) sum += lamp_radiance(uniforms.lamps[k], position, l);
  return 0.3 * sum;
}

#ifdef FRAGMENT
// Light of the lamps that a translucent surface reflects to the eye, without shadows.
vec3 lamp_light(Surface s, vec3 normal, vec3 view, vec3 position) {
  vec3 f0 = mix(dielectric_f0, s.albedo, s.metallic), diffuse = s.albedo * (1.0 - s.metallic), sum = vec3(0.0), l;
  float nv = max(abs(dot(normal, view)), 1e-3);
  for (int k = 0; k < int(uniforms.air.x); ++k) {
    Lamp lamp = uniforms.lamps[k];
    vec3 light = lamp_radiance(lamp, position, l), h = normalize(l + view);
    float nl = saturate(dot(normal, l)), vh = saturate(dot(view, h));
    // A lamp that looks large from here has a large highlight.
    float a = max(s.roughness * s.roughness, 0.5 * lamp.position.w * inversesqrt(dot(lamp.position.xyz - position, lamp.position.xyz - position)) + 0.002);
    vec3 fresnel = fresnel_at(f0, vh);
    float lobe = sun_lobe(min(a, 1.0), nl, nv, saturate(dot(normal, h)));
    sum += light * nl * (diffuse * (1.0 - fresnel) + lobe * fresnel);
  }
  return sum;
}
#endif
#endif
