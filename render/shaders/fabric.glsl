// Reflection of fabrics.

// Directions in which u and v grow on the surface (C. Schueler, "Followup: Normal Mapping Without Precomputed
// Tangents", 2013), each of length about 1.
mat2x3 cloth_frame(vec3 position, vec3 n, vec2 uv) {
  vec3 px = dFdx(position), py = dFdy(position);
  vec2 ux = dFdx(uv), uy = dFdy(uv);
  vec3 a = cross(py, n), b = cross(n, px);
  vec3 t = a * ux.x + b * uy.x, s = a * ux.y + b * uy.y;
  return mat2x3(t, s) * inversesqrt(max(max(dot(t, t), dot(s, s)), 1e-20));
}

// Cloth: its fibres scatter light through it and, at grazing angles, back (sheen by A. Estevez and C. Kulla,
// "Production Friendly Microfacet Sheen BRDF", 2017, at roughness 1/4, with the visibility term of D. Neubelt and M.
// Pettineo, 2013).
vec3 shade_fabric(Surface s, vec3 through, vec3 normal, vec3 view, Light light) {
  vec3 l = frame.sun_direction.xyz;
  vec3 h = normalize(l + view);
  float cosine = dot(normal, l);
  float nl = saturate(cosine), nv = max(abs(dot(normal, view)), 1e-3);
  float nh = saturate(dot(normal, h)), vh = saturate(dot(view, h));

  vec3 f0 = mix(vec3(0.04), s.albedo, s.metallic);
  vec3 fresnel = fresnel_at(f0, vh);
  float lobe = sun_lobe(s.lobe, s.normals, normal, h, nl, nv);
  vec3 sheen = material.sheen.rgb * sqrt(s.albedo);  // fibres are dyed like the cloth
  float grazing = 1.0 - nv, sheen_sky = 0.03 + 0.45 * grazing * grazing * grazing;
  float sin2 = 1.0 - nh * nh, sheen_sun = 0.75 * sin2 * sin2 / (nl + nv - nl * nv);
  float rest = 1.0 - max(sheen.r, max(sheen.g, sheen.b)) * sheen_sky;
  vec3 diffuse = s.albedo * ((1.0 - s.metallic) * rest);

  // Light that enters on one side is scattered until it leaves on either side, so it wraps softly around the shadow's
  // edge.
  float fraction = material.back.w, wrap = 0.35 * fraction, norm = 1.0 / ((1.0 + wrap) * (1.0 + wrap));
  float front = saturate((cosine + wrap) * norm), behind = saturate((wrap - cosine) * norm);
  vec3 sun = diffuse * (1.0 - fresnel) * ((1.0 - fraction) * front) + through * (fraction * behind) +
             nl * (lobe * fresnel + sheen * sheen_sun);

  vec3 reflectance = sky_reflectance(f0, s.roughness, nv);
  vec3 above = light.around + light.lamps, below = ambient(-normal) * light.open;
  vec3 mirrored = reflected_light(view, normal, s.roughness, light);
  vec3 sky = diffuse * (1.0 - reflectance) * (1.0 - fraction) * above + through * fraction * below + mirrored * reflectance +
             sheen * sheen_sky * above;
  return frame.sun_radiance.rgb * light.sun * sun + sky + s.emission;
}
