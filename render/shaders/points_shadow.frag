// A dithered disc or streak in the shadow map; for a ball the disc through its centre, which has the same shadow.
layout(location = 0) in vec3 place;
layout(location = 1) flat in vec2 dimming;
layout(location = 1) uniform vec4 style;
#ifdef PICTURES
layout(location = 5) flat in vec3 picture;  // two layers, share of the second one
layout(binding = 1) uniform sampler2DArray pictures;
#endif

void main() {
#if STYLE == 2
  if (dot(place.xy, place.xy) > 1.0) discard;
#elif defined(PICTURES)
  float alpha = dimming.x * mix(texture(pictures, vec3(place.xy, picture.x)).a,
                                texture(pictures, vec3(place.xy, picture.y)).a, picture.z);
  if (alpha <= dither(gl_FragCoord.xy, frame.shadow.w + dimming.y)) discard;
#else
  if (dimming.x * coverage(place, style.x) <= dither(gl_FragCoord.xy, frame.shadow.w + dimming.y)) discard;
#endif
}
