// The sky, equal to sky_radiance() in sky.cpp.
float glow_profile(vec3 direction) {
  float x = max(dot(direction, frame.sun_direction.xyz), 0.0);
  float x2 = x * x, x4 = x2 * x2, x8 = x4 * x4, x16 = x8 * x8, x64 = x16 * x16 * x16 * x16;
  return 0.25 * x8 + 0.75 * x64;
}

vec3 sky_gradient(float y) {
  float u = 1.0 - saturate(y), u2 = u * u, u4 = u2 * u2;
  return mix(frame.zenith.rgb, frame.horizon.rgb, 0.3 * u2 + 0.7 * u4 * u4);
}

#ifdef SKY_PICTURE
// The picture of the sky, in equirectangular projection. Its dim part is prefiltered for five values of roughness; its
// bright part is traced as a light.
layout(binding = 23) uniform sampler2D sky_levels;

vec2 sky_place(vec3 direction) {
  return vec2(0.5 + atan(direction.x, -direction.z) * 0.15915494 + frame.glow.w, acos(clamp(direction.y, -1.0, 1.0)) * 0.31830989);
}
vec3 sky_level(vec3 direction, float roughness) {
  return frame.ground.w * textureLod(sky_levels, sky_place(direction), 4.0 * roughness).rgb;
}
#endif

// Ambient light on a white surface, from spherical harmonics of order 2. The last two of the nine coefficients are in
// the fourth components of the others.
vec3 ambient(vec3 n) {
  vec4 c[7] = frame.irradiance;
  vec3 c7 = vec3(c[0].w, c[1].w, c[2].w), c8 = vec3(c[3].w, c[4].w, c[5].w);
  return max(c[0].rgb + c[1].rgb * n.y + c[2].rgb * n.z + c[3].rgb * n.x + c[4].rgb * (n.x * n.y) + c[5].rgb * (n.y * n.z) +
             c[6].rgb * (3.0 * n.z * n.z - 1.0) + c7 * (n.x * n.z) + c8 * (n.x * n.x - n.y * n.y), 0.0);
}

// Sky reflected from a direction by a surface of this roughness; blurred with increasing roughness.
vec3 sky_reflection(vec3 direction, float roughness) {
#ifdef SKY_PICTURE
  return sky_level(direction, roughness);
#endif
  float blur = 0.02 + 0.5 * roughness;
  vec3 sharp = mix(sky_gradient(direction.y) + frame.glow.rgb * glow_profile(direction), frame.ground.rgb,
                   smoothstep(-blur, blur, -direction.y));
  return mix(sharp, ambient(direction), roughness * roughness);
}

vec3 horizon_color(vec3 direction) {
  vec3 level = normalize(vec3(direction.x, max(direction.y, 0.0), direction.z));
#ifdef SKY_SEEN
  return sky_level(level, 0.5);
#endif
  return sky_gradient(level.y) + frame.glow.rgb * glow_profile(level);
}

// Light added on the way from a point to the eye, and in w the fraction of the point's own light that arrives, through fog
// and an additional optical depth.
vec4 fog_to(vec3 position, float more) {
  vec3 ray = position - frame.eye.xyz;
  float distance = length(ray);
  float transmittance = exp(-(frame.zenith.w * distance + more));
  return vec4(horizon_color(ray / max(distance, 1e-6)) * (1.0 - transmittance), transmittance);
}
vec4 fog_to(vec3 position) { return fog_to(position, 0.0); }

// Optical depth that hides the last quarter of a degree of an endless plane below its horizon, so that the plane meets
// the sky without an edge and its pattern does not flicker. It depends only on directions, so scenes of any size look
// alike.
float horizon_haze(vec3 normal, vec3 view) {
  float near_horizon = 0.004 / max(abs(dot(normal, view)), 1e-6);
  return near_horizon * near_horizon;
}

vec3 apply_fog(vec3 color, vec3 position) {
  vec4 fog = fog_to(position);
  return color * fog.w + fog.rgb;
}
