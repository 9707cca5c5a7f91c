// One quad per particle, facing the eye. STYLE is 0 sprite, 2 sphere, 5 flake.
layout(location = 0) in vec4 in_position;  // w: radius
layout(location = 1) in vec4 in_velocity;  // w: random number in [0, 1)
layout(location = 2) in vec4 in_color;
#if STYLE != 2
layout(location = 3) in vec4 style;       // softness, stretch [s]; fraction of the sun, or -1: not lit; additive
layout(location = 4) in vec4 in_picture;  // angle, two layers of the sheet, fraction of the second one
layout(location = 5) in vec4 in_light[3]; // light of lamps and from around: constant and slope of red, green, blue
#ifdef PICTURES
layout(location = 8) in vec2 in_size;     // size of the picture [px], which is in the corner of its layer
#endif
#endif

// Position on the quad in radii: across, up, and half the length of its axis, which is vertical.
// With pictures: coordinates on the picture.
layout(location = 0) out vec3 place;
#if STYLE == 2
layout(location = 1) flat out vec4 color;
layout(location = 2) flat out vec4 ball;     // centre, radius
layout(location = 3) out vec3 on_quad;  // position on the quad, from the centre
#ifdef CHANNELS
layout(location = 4) flat out vec3 velocity;
#endif
#else
layout(location = 1) out vec4 light;         // fog included; w: alpha
layout(location = 2) out float reach;        // radius
#if STYLE == 5
layout(location = 3) flat out vec2 lobe;     // direction of a flake's first corner
#endif
layout(location = 4) flat out vec2 rim;      // softness, additive
#ifdef PICTURES
layout(location = 5) flat out vec3 picture;  // two layers, fraction of the second one
layout(location = 6) out vec3 haze;          // fog between eye and particle
layout(binding = 1) uniform sampler2DArray pictures;
#endif
#endif

// Unit vector from a particle to the eye, and the width of a pixel there.
vec4 viewer_of(vec3 p) {
  vec3 to_eye = frame.eye.xyz - p;
  float distance = max(length(to_eye), 1e-6);
  return vec4(to_eye / distance, frame.eye.w * distance);
}

#if STYLE != 2
// The light of lamps and from around on a white surface with this normal.
vec3 light_around(vec3 n) {
  vec4 at = vec4(1.0, n);
  return max(vec3(dot(in_light[0], at), dot(in_light[1], at), dot(in_light[2], at)), 0.0);
}
#endif

#if STYLE == 0
// A puff is a soft ball. It is bright on the side of the light, and brighter if the light is behind it.
vec3 puff_light(vec3 n, vec3 to_viewer) {
  vec3 l = frame.sun_direction.xyz;
  float forward = saturate(-dot(l, to_viewer)), forward2 = forward * forward;
  float phase = max(0.45 + 0.35 * dot(n, l) + 0.8 * forward2 * forward2, 0.0);
  // Some light reaches the shadow of a cloud from all sides.
  return light_around(n) + frame.sun_radiance.rgb * (phase * mix(0.2, 1.0, style.z));
}
#elif STYLE == 5
// Ice and dust transmit light in all directions, most of it forwards.
vec3 flake_light(vec3 to_viewer) {
  float forward = saturate(-dot(frame.sun_direction.xyz, to_viewer)), forward2 = forward * forward;
  return light_around(vec3(0.0, 0.5, 0.0)) + frame.sun_radiance.rgb * (style.z * (0.4 + 0.8 * forward2 * forward2));
}
#endif

void main() {
  vec2 corner = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 2.0 - 1.0;
  vec3 p = in_position.xyz;
  float radius = in_position.w, alpha = in_color.a;
  vec4 viewer = viewer_of(p);
  vec3 u = normalize(cross(abs(viewer.y) < 0.99 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0), viewer.xyz));

  // Particles thinner than a pixel are drawn about one pixel wide and fainter.
  float drawn = STYLE == 2 ? radius : max(radius, 0.6 * viewer.w);
  float thinning = radius / drawn;
  place = vec3(corner, 0.0);
#if STYLE == 2
  vec3 w = cross(viewer.xyz, u);
  float half_side = drawn;
  // The cone from the eye that touches the ball gives its silhouette.
  float sine = radius * frame.eye.w / viewer.w;
  half_side *= inversesqrt(max(1.0 - sine * sine, 0.02));
  on_quad = half_side * (u * corner.x + w * corner.y);
  vec3 at = p + on_quad;
#else
  vec3 half_axis = in_velocity.xyz * (0.5 * style.y);
  vec3 across_view = half_axis - viewer.xyz * dot(half_axis, viewer.xyz);
  float half_length = length(across_view);
  vec3 w = cross(viewer.xyz, u);
  if (half_length > 1e-6) {
    w = across_view / half_length;
    u = cross(w, viewer.xyz);
  }
  alpha *= thinning * thinning;
  // The length of a particle, with its rounded ends, is the length of its motion.
  float straight = max(half_length - drawn, 0.0) / drawn;
  vec3 lengthening = half_axis * (half_length > drawn ? 1.0 - drawn / half_length : 0.0);
#ifdef PICTURES
  vec2 side = in_size / max(in_size.x, in_size.y);
  float turn_cos = cos(in_picture.x), turn_sin = sin(in_picture.x);
  vec3 side_u = u * turn_cos + w * turn_sin, side_w = w * turn_cos - u * turn_sin;
  vec2 from_center = drawn * side * corner;
  vec3 offset = side_u * from_center.x + side_w * from_center.y;
  // A picture is stretched along the motion, whatever the direction of its own axes.
  vec3 at = p + offset + lengthening * (half_length > drawn ? dot(offset, w) / drawn : 0.0);
  place = vec3(vec2(0.5 + 0.5 * corner.x, 0.5 - 0.5 * corner.y) * (in_size / vec2(textureSize(pictures, 0).xy)), 0.0);
  picture = in_picture.yzw;
#else
  vec3 at = p + lengthening * corner.y + drawn * (w * corner.y + u * corner.x);
  place = vec3(corner.x, corner.y * (straight + 1.0), straight);
#endif
#endif

  gl_Position = uniforms.clip_from_world * vec4(at, 1.0);
#if STYLE == 5
  float turn = 6.2831853 * in_velocity.w + in_picture.x;
  lobe = vec2(cos(turn), sin(turn));
#endif
#if STYLE == 2
  color = in_color;
  ball = in_position;
#ifdef CHANNELS
  velocity = in_velocity.xyz;
#endif
#else
  // Fog dims added light, but does not add its own colour.
  vec4 fog = fog_to(p) * vec4(vec3(1.0 - style.w), 1.0);
  // Particles near the lens fade out before they are cut.
  light = vec4(in_color.rgb, alpha * saturate(0.5 * (gl_Position.w - uniforms.depth.z) / drawn));
  reach = drawn;
  rim = vec2(style.x, style.w);
  if (style.z >= 0.0) {
#if STYLE == 0
    vec3 shine = puff_light(normalize(u * corner.x + w * corner.y + 0.7 * viewer.xyz), viewer.xyz);
#elif STYLE == 5
    vec3 shine = flake_light(viewer.xyz);
#endif
    light.rgb *= shine;
  }
#ifdef PICTURES
  light.rgb *= fog.w;
  haze = fog.rgb;
#else
  light.rgb = light.rgb * fog.w + fog.rgb;
#endif
#endif
}
