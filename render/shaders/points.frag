// Sprites and streaks, blended over the finished opaque picture.
layout(location = 0) in vec3 position;
layout(location = 1) in vec2 across;
layout(location = 2) flat in vec4 tint;
layout(location = 3) flat in vec4 center;
layout(location = 4) in vec3 radiance;
layout(location = 5) flat in vec3 side;
layout(location = 6) flat in float visibility;
layout(location = 9) flat in vec4 fog;
#if STYLE == 1
layout(location = 7) in float along;
layout(location = 8) flat in float half_length;
#endif
layout(location = 1) uniform vec4 style;  // softness, stretch [s], lit, additive
layout(binding = 4) uniform sampler2D scene_depth;
layout(location = 0) out vec4 color;

float distance_of(float depth) { return frame.depth.x / (depth + frame.depth.y); }

// Fades where the particle meets a surface or the lens, instead of being cut.
float depth_fade() {
  float here = distance_of(gl_FragCoord.z);
  float behind = distance_of(texelFetch(scene_depth, ivec2(gl_FragCoord.xy), 0).r);
  return smoothstep(0.0, center.w, behind - here) * smoothstep(0.0, 2.0 * center.w, here - frame.depth.z);
}

#if STYLE == 1
// A drop drawn out by its motion: it refracts the sky behind it and mirrors the sky beside it, and it is bright when
// the sun stands behind it.
vec3 drop_light(vec3 view) {
  float x = clamp(across.x, -0.98, 0.98);
  vec3 n = side * x + view * sqrt(1.0 - x * x);
  float m = 1.0 - dot(n, view), m2 = m * m;
  float fresnel = 0.02 + 0.98 * m2 * m2 * m;
  vec3 through = mix(sky_reflection(normalize(-view - 1.2 * x * side), 0.25), ambient(vec3(0.0, 1.0, 0.0)), 0.5);
  float forward = 0.5 - 0.5 * dot(frame.sun_direction.xyz, view), forward4 = forward * forward * forward * forward;
  vec3 sun = frame.sun_radiance.rgb * (visibility * (0.12 + 0.9 * forward4 * forward4));
  return tint.rgb * (through + sun) * (1.0 - fresnel) + fresnel * sky_reflection(reflect(-view, n), 0.1);
}
#endif

void main() {
#if STYLE == 1
  float alpha = tint.a * coverage(from_axis(across.x, along, half_length), style.x);
  vec3 light = style.z != 0.0 ? drop_light(normalize(frame.eye.xyz - position)) : tint.rgb;
  light = light * fog.w + fog.rgb;
#else
  float alpha = tint.a * coverage(across, style.x);
  vec3 light = radiance;
#endif
  alpha *= depth_fade();
  color = vec4(light * alpha, alpha * (1.0 - style.w));
}
