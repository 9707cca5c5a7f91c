// A ball by ray casting on its quad.
layout(location = 1) flat in vec4 color;
layout(location = 2) flat in vec4 ball;  // centre, radius
layout(location = 3) in vec3 on_quad;  // position on the quad, from the centre
layout(location = 1) uniform vec4 style;  // z: negative if not lit
layout(location = 2) uniform vec2 surface;  // metallic, roughness
#ifndef SURFACE
layout(location = 0) out vec4 result;
#endif

void main() {
  vec3 ray = normalize(ball.xyz - frame.eye.xyz + on_quad);
  // From the centre to the ray. It is computed from the position on the quad, and not from the distant eye, so that rounding
  // errors are small relative to the ball and its outline does not depend on the driver.
  vec3 nearest = on_quad - ray * dot(on_quad, ray);
  float h2 = ball.w * ball.w - dot(nearest, nearest);
  if (h2 < 0.0) discard;
  vec3 offset = nearest - ray * sqrt(h2);
  vec3 hit = ball.xyz + offset;
  vec3 n = offset / ball.w;
  vec4 clip = uniforms.clip_from_world * vec4(hit, 1.0);
  gl_FragDepth = clip.z / clip.w;
#ifdef SURFACE
  float mirror = surface.x > 0.5 ? 10.0 : surface.y < 0.3 ? 2.0 : 0.0;
  write_surface(hit, n, n, -ray, surface.y + mirror);
#else
  vec3 radiance = color.rgb;
  if (style.z >= 0.0) {
    float pixel = frame.eye.w * distance(frame.eye.xyz, hit) / ball.w;  // width of a pixel, in radii
    Normals normals = Normals(vec3(0.0), min(0.25 * pixel * pixel / max(-dot(n, ray), 0.1), 0.18));
    Surface s = Surface(color.rgb, surface.y, surface.x, vec3(0.0), surface.y, normals);
    radiance = shade(s, n, -ray, traced_light(n, n, n)) + highlights_of_lamps(mix(vec3(0.04), s.albedo, s.metallic));
  }
  result = vec4(apply_fog(radiance, hit), 1.0);
#endif
}
