// Sprites and streaks, blended over the finished opaque picture.
layout(location = 0) in vec3 place;
layout(location = 1) in vec4 light;
layout(location = 2) in vec4 rim;
layout(location = 1) uniform vec4 style;  // softness, stretch [s], lit, additive
layout(binding = 4) uniform sampler2D scene_depth;
layout(location = 0) out vec4 color;

// Fades where a sprite meets a surface, instead of being cut.
float depth_fade(float radius) {
  float behind = frame.depth.x / (texelFetch(scene_depth, ivec2(gl_FragCoord.xy), 0).r + frame.depth.y);
  return saturate((behind - 1.0 / gl_FragCoord.w) / radius);
}

void main() {
  vec3 radiance = light.rgb;
  float alpha = light.a * coverage(place, style.x);
#if STYLE == 0
  alpha *= depth_fade(rim.w);
#else
  float m = 1.0 - sqrt(max(1.0 - place.x * place.x, 0.0)), m2 = m * m;
  radiance = mix(radiance, rim.rgb, 0.02 + 0.98 * m2 * m2 * m);  // Fresnel
#endif
  color = vec4(radiance * alpha, alpha * (1.0 - style.w));
}
