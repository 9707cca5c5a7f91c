// Light of lamps. Their positions change a little from sub-frame to sub-frame, within the lamp.
#ifdef LAMPS
// Radiance of a white surface that faces the lamp, and the unit vector to it.
vec3 lamp_radiance(Lamp lamp, vec3 position, out vec3 l) {
  vec3 v = lamp.position.xyz - position;
  float d2 = dot(v, v);
  l = v * inversesqrt(d2 + 1e-12);
  float share = saturate(lamp.right.w - lamp.direction.w * dot(l, lamp.direction.xyz));
  return lamp.intensity.rgb * (share / (d2 + 0.25 * lamp.position.w * lamp.position.w));
}

// Light on a particle so small that it is lit from all sides.
vec3 lamps_all_around(vec3 position) {
  vec3 sum = vec3(0.0), l;
  for (int k = 0; k < int(uniforms.air.x); ++k) sum += lamp_radiance(uniforms.lamps[k], position, l);
  return 0.3 * sum;
}

#ifdef FRAGMENT
layout(binding = 10) uniform sampler2DShadow lamp_shadows;
layout(binding = 11) uniform sampler2D lamp_depths;  // the same texture without comparison
const float kLampNear = 0.02;                        // depth is 1 - near / distance

// Position in the shadow map, and in z the distance along the tile's axis.
vec3 lamp_place(Lamp lamp, vec3 v, out vec4 tile) {
  vec3 p = vec3(dot(v, lamp.right.xyz), dot(v, lamp.up.xyz), dot(v, lamp.direction.xyz));
  vec2 corner = vec2(0.0);
  if (lamp.intensity.w > 1.5) {
    vec3 a = abs(v);
    float along;
    if (a.x > max(a.y, a.z)) { p = v.yzx; corner.x = 0.0; along = v.x; }
    else if (a.y > a.z) { p = v.zxy; corner.x = 1.0; along = v.y; }
    else { p = v; corner.x = 2.0; along = v.z; }
    corner.y = along < 0.0 ? 1.0 : 0.0;
    p.z = abs(along);
  }
  vec2 first = lamp.block.xy + corner * lamp.block.zw, margin = 1.5 / vec2(textureSize(lamp_depths, 0));
  tile = vec4(first + margin, first + lamp.block.zw - margin);
  return vec3(first + (0.5 + 0.5 * p.xy / (max(p.z, 1e-4) * lamp.up.w)) * lamp.block.zw, p.z);
}

float lamp_visibility(Lamp lamp, vec3 position, vec3 normal) {
  if (lamp.intensity.w == 0.0) return 1.0;
  vec3 v = position - lamp.position.xyz;
  vec2 texel = 1.0 / vec2(textureSize(lamp_depths, 0));
  float size_px = lamp.block.z / texel.x, wide = 2.0 * lamp.up.w * length(v) / size_px;
  vec4 tile;
  vec3 p = lamp_place(lamp, v + wide * (1.5 * normal - 0.7 * normalize(v)), tile);
  if (p.z < kLampNear || any(notEqual(p.xy, clamp(p.xy, tile.xy - 0.01, tile.zw + 0.01)))) return p.z < kLampNear ? 1.0 : 0.0;
  float turn = 6.2831853 * dither(gl_FragCoord.xy, frame.shadow.w + 0.31), z = 1.0 - kLampNear / p.z;
  vec2 a = vec2(cos(turn), sin(turn));
  float px_per_m = 0.5 * size_px / (lamp.up.w * p.z), sub = inversesqrt(uniforms.air.w);
  float search = min(0.5 * lamp.position.w * px_per_m * sub, 16.0) + 1.0, sum = 0.0, blockers = 0.0;
  for (int k = 0; k < 4; ++k) {
    vec4 depth = textureGather(lamp_depths, clamp(p.xy + a * (0.7 * search * texel), tile.xy, tile.zw));
    vec4 blocks = vec4(lessThan(depth, vec4(z)));
    sum += dot(blocks, kLampNear / (1.0 - depth));
    blockers += dot(blocks, vec4(1.0));
    a = vec2(-a.y, a.x);
  }
  int taps = blockers == 0.0 || blockers == 16.0 ? 0 : (uniforms.air.w < 16.0 ? 6 : 4);
  float between = sum / max(blockers, 1.0), lit = 0.0;
  float penumbra = clamp(lamp.position.w * (p.z - between) / max(between, kLampNear) * px_per_m * sub, 1.0, 16.0);
  for (int k = 0; k < taps; ++k) {
    vec2 at = p.xy + a * (penumbra * texel * sqrt((float(k) + 0.5) / float(taps)));
    lit += texture(lamp_shadows, vec3(clamp(at, tile.xy, tile.zw), z));
    a = mat2(-0.73736888, -0.67549029, 0.67549029, -0.73736888) * a;  // rotation by the golden angle
  }
  return taps == 0 ? (blockers == 0.0 ? 1.0 : 0.0) : lit / float(taps);
}

// Light of the lamp that a surface reflects to the eye. `smooth_normal` excludes the relief.
vec3 lamp_light(Surface s, vec3 normal, vec3 smooth_normal, vec3 view, vec3 position) {
  vec3 f0 = mix(dielectric_f0, s.albedo, s.metallic), diffuse = s.albedo * (1.0 - s.metallic), sum = vec3(0.0), l;
  float nv = max(abs(dot(normal, view)), 1e-3);
  for (int k = 0; k < int(uniforms.air.x); ++k) {
    Lamp lamp = uniforms.lamps[k];
    vec3 light = lamp_radiance(lamp, position, l), h = normalize(l + view);
    float nl = saturate(dot(normal, l)), vh = saturate(dot(view, h));
    // A lamp that looks large from here has a large highlight.
    float a = max(s.roughness * s.roughness, 0.5 * lamp.position.w * inversesqrt(dot(lamp.position.xyz - position, lamp.position.xyz - position)) + 0.002);
    vec3 fresnel = fresnel_at(f0, vh);
    float lobe = sun_lobe(min(a, 1.0), nl, nv, saturate(dot(normal, h)));
    sum += light * (nl * lamp_visibility(lamp, position, smooth_normal)) * (diffuse * (1.0 - fresnel) + lobe * fresnel);
  }
  return sum;
}
#endif
#endif
