// Uniforms of a frame that all shaders share; the same fields as FrameUniforms in frame.h.
struct Lamp {
  vec4 position;   // w: radius
  vec4 intensity;  // radiance of a white surface at 1 m
  vec4 direction;  // w: factor of the cosine to this direction
  vec4 right;  // w: offset; factor * cosine + offset, in [0, 1], is the share of light in that direction
};

// Values that shading reads for nearly every pixel. One member a declaration: for lists, NVIDIA's compiler (driver 580)
// assigns one location to all members.
#define NONE
#define FRAME_FIELDS(qualifier) \
  qualifier vec4 eye;               /* w: size of a pixel at distance 1 */ \
  qualifier vec4 shadow_rows[3];    /* world to [0, 1] of the shadow map, by rows */ \
  qualifier vec4 sun_direction;     /* w: 1 if the shadow map holds something */ \
  qualifier vec4 sun_radiance;      /* of a white surface that faces it; w: radius of the disc [rad] */ \
  qualifier vec4 zenith;            /* w: fog density */ \
  qualifier vec4 horizon;           /* w: 1 if one of many sub-frames */ \
  qualifier vec4 ground;            /* w: intensity of the sky's picture */ \
  qualifier vec4 glow;              /* w: turn of the sky's picture, as a share of a full turn */ \
  qualifier vec4 irradiance[7];     /* ambient light of a white surface: see ambient() */ \
  qualifier vec4 shadow;            /* size of a texel [m], texels, 1 / texels, seed of the dither */ \
  qualifier vec4 penumbra;          /* of the shadow map: half-width [texels] per depth, the widest [texels], depth per its width, taps */

layout(std140, binding = 0) uniform Frame {
  mat4 clip_from_world;
  mat4 smoke_from_world;  // maps to [0, 1] of the grid of the smoke's optical depth
  FRAME_FIELDS(NONE)
  vec4 ray_center, ray_x, ray_y;  // direction through a point of the screen: center + x * ndc.x + y * ndc.y
  vec4 depth;             // distance along the view axis = x / (depth + y); z: near plane
  vec4 air;               // number of lamps, time [s], share of clouds, number of sub-frames
  Lamp lamps[8];
} uniforms;

// llvmpipe's fragment shaders read a uniform lane by lane, with forty instructions (Mesa 22.3), which was half of the
// cost of shading. Flat inputs are as fast as constants, so these fields are passed with each triangle.
#ifndef FLAT
#define frame uniforms
#elif defined(FRAGMENT)
layout(location = 8) in FlatFrame { FRAME_FIELDS(flat) } frame;
#else
#define frame uniforms
layout(location = 8) out FlatFrame { FRAME_FIELDS(flat) } flat_frame;
void pass_frame() {
  flat_frame.eye = uniforms.eye;
  flat_frame.shadow_rows = uniforms.shadow_rows;
  flat_frame.sun_direction = uniforms.sun_direction;
  flat_frame.sun_radiance = uniforms.sun_radiance;
  flat_frame.zenith = uniforms.zenith;
  flat_frame.horizon = uniforms.horizon;
  flat_frame.ground = uniforms.ground;
  flat_frame.glow = uniforms.glow;
  flat_frame.irradiance = uniforms.irradiance;
  flat_frame.shadow = uniforms.shadow;
  flat_frame.penumbra = uniforms.penumbra;
}
#endif

float saturate(float x) { return clamp(x, 0.0, 1.0); }

// A threshold in [0, 1) for each pixel, by the R2 sequence of M. Roberts, whose mean over a few neighbours is even.
float dither(vec2 pixel, float shift) {
  return fract(dot(floor(pixel), vec2(0.75487767, 0.56984029)) + shift);
}
