layout(location = 0) in vec2 place;
layout(location = 1) flat in vec3 stroke;
layout(location = 2) flat in vec4 color;
layout(location = 2) uniform float opacity;
layout(location = 0) out vec4 result;

void main() {
  float along = clamp(place.x, 0.0, stroke.x);
  float radius = mix(stroke.y, stroke.z, stroke.x > 0.0 ? along / stroke.x : 0.0);
  float d = distance(place, vec2(along, 0.0));
  // Fraction of a pixel's width that the line covers, so that thin lines get fainter instead of jagged.
  float alpha = color.a * opacity * saturate(min(d + 0.5, radius) - max(d - 0.5, -radius));
  result = vec4(color.rgb * alpha, alpha);
}
