// A dithered disc or streak in the shadow map; for a ball the disc through its centre, which has the same shadow.
layout(location = 0) in vec3 place;
layout(location = 1) flat in vec2 dimming;
layout(location = 1) uniform vec4 style;

void main() {
#if STYLE == 2
  if (dot(place.xy, place.xy) > 1.0) discard;
#else
  if (dimming.x * coverage(place, style.x) <= dither(gl_FragCoord.xy, frame.shadow.w + dimming.y)) discard;
#endif
}
