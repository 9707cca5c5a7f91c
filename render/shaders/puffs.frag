// Composites smoke and fire, drawn in a smaller picture, over the scene. Of the four texels around a pixel, those with
// a scene depth similar to the pixel's are used.
// x: pixels per texel; y: depth over which puffs change little [m]; z: depth of the farthest puff [m].
layout(location = 0) uniform vec3 scale;
layout(location = 1) uniform ivec4 region;  // texels with content: first, last
layout(binding = 4) uniform sampler2D scene_depth;
layout(binding = 6) uniform sampler2D puffs;  // w: remaining fraction of the scene
layout(binding = 7) uniform sampler2D puff_depth;
layout(location = 0) out vec4 color;

void main() {
  float depth = min(uniforms.depth.x / (texelFetch(scene_depth, ivec2(gl_FragCoord.xy), 0).r + uniforms.depth.y), scale.z);
  vec2 p = gl_FragCoord.xy / scale.x - 0.5;
  vec2 base = floor(p), f = p - base;
  vec4 sum = vec4(0.0);
  float weights = 0.0;
  for (int k = 0; k < 4; ++k) {
    vec2 corner = vec2(float(k & 1), float(k >> 1));
    ivec2 texel = clamp(ivec2(base + corner), region.xy, region.zw);
    vec2 fraction = mix(1.0 - f, f, corner);
    float off = (texelFetch(puff_depth, texel, 0).r - depth) / scale.y;
    float weight = (fraction.x * fraction.y + 1e-4) / (1.0 + off * off);
    sum += weight * texelFetch(puffs, texel, 0);
    weights += weight;
  }
  sum /= weights;
  color = vec4(sum.rgb, 1.0 - sum.a);
}
