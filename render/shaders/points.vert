// One quad per particle. STYLE is 0 sprite, 1 streak, 2 sphere; with SHADOW it faces the sun instead of the eye.
layout(location = 0) in vec4 in_position;  // w: radius
layout(location = 1) in vec4 in_velocity;  // w: a number of its own in [0, 1)
layout(location = 2) in vec4 in_color;
#ifdef SHADOW
layout(location = 0) uniform mat4 shadow_clip_from_world;
#endif
layout(location = 1) uniform vec4 style;  // softness, stretch [s], lit, additive

layout(location = 0) out vec3 position;         // on the quad
layout(location = 1) out vec2 across;           // place on it in radii, from the nearest place of the particle's axis
layout(location = 2) flat out vec4 tint;
layout(location = 3) flat out vec4 center;      // w: radius
#ifdef SHADOW
layout(location = 4) flat out float shadow_seed;
#else
layout(location = 4) out vec3 radiance;         // of a sprite, fog included
layout(location = 5) flat out vec3 side;
layout(location = 6) flat out float visibility;
layout(location = 9) flat out vec4 fog;
#endif
#if STYLE == 1
layout(location = 7) out float along;           // place along the axis in radii, 0 at its middle
layout(location = 8) flat out float half_length;
#endif

void main() {
  vec2 corner = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 2.0 - 1.0;
  vec3 p = in_position.xyz;
  float radius = in_position.w;
  tint = in_color;
#ifdef SHADOW
  vec3 to_viewer = frame.sun_direction.xyz;
  float pixel = frame.shadow.x;
#else
  vec3 to_viewer = frame.eye.xyz - p;
  float distance = max(length(to_viewer), 1e-6);
  to_viewer /= distance;
  float pixel = frame.eye.w * distance;
#endif
  vec3 u = normalize(cross(abs(to_viewer.y) < 0.99 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0), to_viewer));

#if STYLE == 1
  vec3 half_axis = in_velocity.xyz * (0.5 * style.y);
  vec3 flat_axis = half_axis - to_viewer * dot(half_axis, to_viewer);
  float flat_length = length(flat_axis);
  vec3 w = flat_length > 1e-6 ? flat_axis / flat_length : cross(to_viewer, u);
  u = cross(w, to_viewer);
  // What would be thinner than a pixel stays one wide and gets fainter instead.
  float drawn = max(radius, 0.75 * pixel);
  tint.a *= radius / drawn;
  half_length = max(flat_length - drawn, 0.0) / drawn;  // rounded ends included, it is as long as it moved
  float reach = flat_length > drawn ? 1.0 - drawn / flat_length : 0.0;
  position = p + half_axis * (reach * corner.y) + drawn * (w * corner.y + u * corner.x);
  across = corner;
  along = corner.y * (half_length + 1.0);
  radius = drawn;
#else
  vec3 w = cross(to_viewer, u);
#if STYLE == 0
  float drawn = max(radius, 0.75 * pixel);
  tint.a *= (radius / drawn) * (radius / drawn);
  radius = drawn;
  float reach = radius;
#elif defined(SHADOW)
  float reach = radius;
#else
  // The silhouette is that of the cone from the eye that touches the ball.
  float reach = radius * inversesqrt(max(1.0 - radius * radius / (distance * distance), 0.02));
#endif
  position = p + reach * (u * corner.x + w * corner.y);
  across = corner;
#endif

  center = vec4(p, radius);
#ifdef SHADOW
  shadow_seed = in_velocity.w;
  gl_Position = shadow_clip_from_world * vec4(position, 1.0);
#else
  side = u;
  radiance = tint.rgb;
  visibility = 1.0;
  // Added light is dimmed by the fog but brings none of its colour.
  fog = fog_to(p) * vec4(vec3(1.0 - style.w), 1.0);
#if STYLE == 0
  if (style.z != 0.0) {
    vec3 l = frame.sun_direction.xyz;
    vec3 spread = cross(l, u) * (0.6 * radius), spread2 = cross(l, w) * (0.6 * radius);
    vec3 front = p + radius * l;
    visibility = 0.25 * (sun_visibility(front + spread, l) + sun_visibility(front - spread, l) +
                         sun_visibility(front + spread2, l) + sun_visibility(front - spread2, l));

    // A puff is a soft ball: bright towards the light, brighter still against it.
    vec3 n = normalize(u * corner.x + w * corner.y + 0.7 * to_viewer);
    float forward = saturate(-dot(frame.sun_direction.xyz, to_viewer)), forward2 = forward * forward;
    float phase = 0.45 + 0.35 * dot(n, frame.sun_direction.xyz) + 0.8 * forward2 * forward2;
    float scattered = mix(0.2, 1.0, visibility);  // some light gets into the shadow of a cloud from all around
    radiance *= ambient(n) + frame.sun_radiance.rgb * (scattered * max(phase, 0.0));
  }
  radiance = radiance * fog.w + fog.rgb;
#elif STYLE == 1
  if (style.z != 0.0) visibility = sun_visibility(p, frame.sun_direction.xyz);
#endif
  gl_Position = frame.clip_from_world * vec4(position, 1.0);
#endif
}
