// Sprites and flakes, blended over the background.
layout(location = 0) in vec3 place;
layout(location = 1) in vec4 light;
layout(location = 2) in float reach;
#if STYLE == 5
layout(location = 3) flat in vec2 lobe;
#endif
layout(location = 4) flat in vec2 rim;  // softness, additive
#ifdef PICTURES
layout(location = 5) flat in vec3 picture;  // two layers, fraction of the second one
layout(location = 6) in vec3 haze;
layout(binding = 1) uniform sampler2DArray pictures;  // premultiplied
#endif
layout(binding = 4) uniform sampler2D scene_depth;
layout(location = 0) out vec4 color;

// Returns a factor that fades a sprite out where it meets a surface, so that the surface does not cut it.
float depth_fade(float radius) {
  float behind = uniforms.depth.x / (texelFetch(scene_depth, ivec2(gl_FragCoord.xy), 0).r + uniforms.depth.y);
  return saturate((behind - 1.0 / gl_FragCoord.w) / radius);
}

void main() {
  vec3 radiance = light.rgb;
#ifdef PICTURES
  vec4 texel = mix(texture(pictures, vec3(place.xy, picture.x)), texture(pictures, vec3(place.xy, picture.y)), picture.z);
  float fraction = light.a * depth_fade(reach);
  color = vec4((light.rgb * texel.rgb + haze * texel.a) * fraction, texel.a * fraction * (1.0 - rim.y));
}
#else
#if STYLE == 5
  // Approximately three blunt corners.
  float c = dot(place.xy, lobe) * inversesqrt(dot(place.xy, place.xy) + 1e-6);
  float alpha = light.a * coverage(place * (1.15 - 0.15 * c * (4.0 * c * c - 3.0)), rim.x);
#else
  float alpha = light.a * coverage(place, rim.x);
#endif
#if STYLE == 0
  alpha *= depth_fade(reach);
#endif
  color = vec4(radiance * alpha, alpha * (1.0 - rim.y));
}
#endif
