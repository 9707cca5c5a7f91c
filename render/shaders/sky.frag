layout(location = 0) in vec3 ray;
layout(location = 0) out vec4 color;

#ifdef SKY_SEEN
layout(binding = 24) uniform sampler2D sky_background;
#endif

// Returns the thickness of fair-weather clouds in a high layer, at least 0.
float cloud_thickness(vec2 p) {
  float sum = 0.0, amplitude = 0.5;
  // Not a constant, so that the loop is not unrolled, which would take long to compile.
  int octaves = uniforms.air.y > 0.0 ? 5 : 0;
  for (int octave = 0; octave < octaves; ++octave) {
    sum += amplitude * noise(p, uint(40 + octave)).x;
    p = mat2(1.6, 1.2, -1.2, 1.6) * p + 7.1;
    amplitude *= 0.5;
  }
  return max(sum - mix(0.78, 0.28, uniforms.air.y), 0.0);
}

vec3 with_clouds(vec3 sky, vec3 d) {
  vec3 l = frame.sun_direction.xyz;
  vec2 p = d.xz / (d.y + 0.06) * 1.3 + uniforms.air.x * vec2(0.006, 0.002);
  float thick = cloud_thickness(p), towards_sun = cloud_thickness(p + 0.12 * l.xz);
  float cover = (1.0 - exp(-9.0 * thick)) * smoothstep(0.015, 0.22, d.y);
  float lit = exp(-5.0 * towards_sun), silver = pow(max(dot(d, l), 0.0), 12.0) * exp(-7.0 * thick);
  vec3 light = frame.irradiance[0].rgb * 1.1 + frame.sun_radiance.rgb * (0.10 + 0.32 * lit + 0.5 * silver) * saturate(2.0 * l.y + 0.3);
  return mix(sky, light, cover);
}

void main() {
  vec3 d = normalize(ray);
#ifdef SKY_SEEN
  // The level whose pixels are as large as those of the frame; the same everywhere, so that there is no seam.
  float level = max(log2(frame.eye.w * float(textureSize(sky_background, 0).x) * 0.15915494), 0.0);
  color = vec4(frame.ground.w * textureLod(sky_background, sky_place(d), level).rgb, 1.0);
  return;
#endif
  // Below the horizon the haze decreases towards the nadir, so that a distant ground plane ends without a visible edge.
  vec3 sky = mix(horizon_color(d), frame.ground.rgb, smoothstep(0.03, 0.5, -d.y));
  float sine = length(cross(d, frame.sun_direction.xyz));
  float radius = frame.sun_radiance.w;
  float disc = (1.0 - smoothstep(0.85 * radius, 1.15 * radius, sine)) *
               step(0.0, dot(d, frame.sun_direction.xyz)) * smoothstep(-0.02, 0.0, d.y);
#ifndef SKY_PICTURE
  sky += frame.sun_radiance.rgb * (8.0 * disc);
#endif
  // Without clouds the loop has no rounds and costs nothing.
  for (int k = 0; k < (uniforms.air.y > 0.0 && d.y > 0.015 ? 1 : 0); ++k) sky = with_clouds(sky, d);
  color = vec4(sky, 1.0);
}
