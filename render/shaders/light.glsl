// Shading of surfaces in light that is known.

// Reflectance of a dielectric that faces the eye.
#if defined(DETAILED) && defined(FRAGMENT)
vec3 dielectric_f0 = vec3(0.04);
#else
#define dielectric_f0 vec3(0.04)
#endif

// The normals within a pixel: an ellipse around the normal in its middle.
struct Normals {
  vec3 major;   // half of its long axis
  float minor2; // square of half of its short axis
};
#define ONE_NORMAL Normals(vec3(0.0), 0.0)

struct Surface {
  vec3 albedo;
  float roughness;
  float metallic;
  vec3 emission;
  float lobe;  // roughness for the sun's highlight
  Normals normals;
};

#ifdef FRAGMENT
// How much the variance of the normal within a pixel increases roughness^4 (Kaplanyan and Tokuyoshi, "Stable Geometric
// Specular Antialiasing", 2019).
float added_roughness4(vec3 normal) {
  vec3 dx = dFdx(normal), dy = dFdy(normal);
  return min(0.5 * (dot(dx, dx) + dot(dy, dy)), 0.18);
}
// Roughness for mirror images, which would flicker where the normal varies within a pixel.
float filtered_roughness(float roughness, vec3 normal) {
  float a = roughness * roughness;
  return sqrt(sqrt(saturate(a * a + added_roughness4(normal))));
}

// Returns the slope of a normal that differs from `normal` by `change`.
vec3 slope_to(vec3 normal, vec3 change) {
  return (change - normal * dot(normal, change)) / max(1.0 - 0.5 * dot(change, change), 0.5);
}

// Returns the normals within a pixel. `normal`: in its middle.
Normals normals_in_pixel(vec3 normal) {
  const float widest2 = 0.18;
  vec3 dx = slope_to(normal, dFdx(normal)), dy = slope_to(normal, dFdy(normal));
  float xx = dot(dx, dx), xy = dot(dx, dy), yy = dot(dy, dy), middle = 0.5 * (xx + yy);
  float apart = sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy), major2 = middle + apart;
  vec3 along = xx > yy ? (major2 - yy) * dx + xy * dy : xy * dx + (major2 - xx) * dy;
  float size2 = dot(along, along);
  return Normals(along * (0.5 * inversesqrt(max(size2, 1e-30)) * sqrt(min(major2, 4.0 * widest2))),
                 0.25 * min(max(middle - apart, 0.0), 4.0 * widest2));
}
#endif

// Means of the GGX distribution, times pi. It is a^2 / (a^2 + u)^2 as a function of u = tan^2 of the angle to the normal.
// Over a disc of radius^2 `disc` around the half vector. The fraction within u is u / (a^2 + u), so the mean is 1 / (a^2 + disc)
// at the normal. Outside of the disc, the mean from u - disc to u is used; `sum` is the sum of both over all directions.
float mean_over_disc(float a2, float u, float disc) {
  float x = disc / a2, sum = x < 0.01 ? 1.0 + 0.5 * x : x / (1.0 + x) + log(1.0 + x) / x;
  return a2 / ((a2 + max(u, disc)) * (a2 + max(u - disc, 0.0)) * sum);
}
// Over a line through the half vector. `along`, `across2`: position of the half vector along the line, and the square of that
// across; `reach`: half of the line's length.
float mean_over_line(float a2, float along, float across2, float reach) {
  float c2 = a2 + across2, c = sqrt(c2), from = along - reach, to = along + reach, product = from * to;
  return a2 * ((c2 - product) / ((c2 + to * to) * (c2 + from * from)) + atan(2.0 * reach * c, c2 + product) / (2.0 * reach * c)) /
         (2.0 * c2);
}

// The sun's highlight: GGX with the visibility term of E. Hammon (2017), times pi. It is the mean over the normals within a
// pixel and over the part of the sun's disc that a sub-frame represents, so that it does not flicker, and is neither wider nor
// darker in a picture of fewer pixels.
float sun_lobe(float roughness, Normals normals, vec3 normal, vec3 h, float nl, float nv) {
  const float brightest = 1e4;
  float a = max(roughness * roughness, 1e-4), a2 = a * a, minor2 = normals.minor2 + frame.irradiance[6].w;
  float cosine = max(dot(normal, h), 0.01), major2 = dot(normals.major, normals.major);
  vec3 slope = (h - normal * dot(normal, h)) / cosine;
  float u = dot(slope, slope), longer = sqrt(major2 / minor2), line = smoothstep(2.0, 4.0, longer), mean = 0.0;
  if (line < 1.0) mean = mean_over_disc(a2, u, minor2 * max(longer, 1.0));
  if (line > 0.0) {
    float reach = sqrt(major2), along = dot(slope, normals.major) / reach;
    mean = mix(mean, mean_over_line(a2 + minor2, along, max(u - along * along, 0.0), reach), line);
  }
  float cos2 = cosine * cosine;
  return min(mean / (cos2 * cos2) * 0.5 / mix(2.0 * nl * nv, nl + nv, a), brightest);
}

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
  vec3 sun;       // fraction of the sun that is visible
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
  float vh = saturate(dot(view, h));

  vec3 f0 = mix(dielectric_f0, s.albedo, s.metallic);
  vec3 fresnel = fresnel_at(f0, vh);
  float lobe = sun_lobe(s.lobe, s.normals, normal, h, nl, nv);
  vec3 diffuse = s.albedo * (1.0 - s.metallic);
  vec3 sun = frame.sun_radiance.rgb * (nl * light.sun) * (diffuse * (1.0 - fresnel) + lobe * fresnel);

  vec3 reflectance = sky_reflectance(f0, s.roughness, nv);
  vec3 mirrored = reflected_light(view, normal, s.roughness, light);
  return sun + (light.around + light.lamps) * diffuse * (1.0 - reflectance) + mirrored * reflectance + s.emission;
}
