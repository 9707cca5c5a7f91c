// A dithered disc or streak in the shadow map; of a ball the disc through its middle, which throws the same shadow.
layout(location = 0) in vec3 position;
layout(location = 1) in vec2 across;
layout(location = 2) flat in vec4 tint;
layout(location = 3) flat in vec4 center;
layout(location = 4) flat in float shadow_seed;
#if STYLE == 1
layout(location = 7) in float along;
layout(location = 8) flat in float half_length;
#endif
layout(location = 1) uniform vec4 style;

void main() {
#if STYLE == 2
  if (dot(across, across) > 1.0) discard;
#else
#if STYLE == 1
  float alpha = tint.a * coverage(from_axis(across.x, along, half_length), style.x);
#else
  float alpha = tint.a * coverage(across, style.x);
#endif
  if (alpha <= dither(gl_FragCoord.xy, frame.shadow.w + shadow_seed)) discard;
#endif
}
