// Uniforms of a frame that all shaders share; the same fields as FrameUniforms in frame.h.
// FRAME_FIELDS are the values that shading reads for nearly every pixel. Each has its own declaration, because NVIDIA's
// compiler (driver 580) assigns one location to all members of a list.
#define NONE
#define FRAME_FIELDS(qualifier) \
  qualifier vec4 eye;               /* w: size of a pixel at distance 1 */ \
  qualifier vec4 sun_direction; \
  qualifier vec4 sun_radiance;      /* of a white surface that faces it; w: radius of the disc [rad] */ \
  qualifier vec4 zenith;            /* w: fog density */ \
  qualifier vec4 horizon; \
  qualifier vec4 ground;            /* w: intensity of the sky's picture */ \
  qualifier vec4 glow;              /* w: turn of the sky's picture, as a fraction of a full turn */ \
  qualifier vec4 irradiance[7];     /* ambient light of a white surface: see ambient(); last w: see sun_lobe() */

layout(std140, binding = 0) uniform Frame {
  mat4 clip_from_world;
  FRAME_FIELDS(NONE)
  vec4 ray_center, ray_x, ray_y;  // direction through a point of the screen: center + x * ndc.x + y * ndc.y
  vec4 depth;             // distance along the view axis = x / (depth + y); z: near plane
  vec4 air;               // time [s], fraction of clouds
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
  flat_frame.sun_direction = uniforms.sun_direction;
  flat_frame.sun_radiance = uniforms.sun_radiance;
  flat_frame.zenith = uniforms.zenith;
  flat_frame.horizon = uniforms.horizon;
  flat_frame.ground = uniforms.ground;
  flat_frame.glow = uniforms.glow;
  flat_frame.irradiance = uniforms.irradiance;
}
#endif

float saturate(float x) { return clamp(x, 0.0, 1.0); }
