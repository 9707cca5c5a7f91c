layout(location = 0) in vec3 ray;
layout(location = 0) out vec4 color;
void main() {
  vec3 d = normalize(ray);
  // Below the horizon the haze thins out towards the nadir, so that a far ground plane ends without a seam.
  vec3 sky = mix(horizon_color(d), frame.ground.rgb, smoothstep(0.03, 0.5, -d.y));
  float sine = length(cross(d, frame.sun_direction.xyz));
  float radius = frame.sun_radiance.w;
  float disc = (1.0 - smoothstep(0.85 * radius, 1.15 * radius, sine)) *
               step(0.0, dot(d, frame.sun_direction.xyz)) * smoothstep(-0.02, 0.0, d.y);
  color = vec4(sky + frame.sun_radiance.rgb * (8.0 * disc), 1.0);
}
