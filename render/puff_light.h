#pragma once
/// Private: the light of puffs and drops. That of a puff is linear in the puff's normals, so that a pixel
/// costs a few products. Light that was scattered several times goes deeper into smoke than light scattered
/// once; its part is a sum of weaker, more slowly damped copies (Wrenninge, Kulla and Lundqvist, "Oz: The
/// Great and Volumetric", 2013).

#include "render/frame.h"
#include "render/opacity_grid.h"
#include "render/sky.h"

namespace offstage::render {

/// Radiance of a white puff where its normal is n, a world direction: constant + slope * n, per channel.
struct PuffRadiance {
  Vector3f constant = Vector3f::Zero();
  Eigen::Matrix3f slope = Eigen::Matrix3f::Zero();  ///< rows: red, green, blue
};

/// The light all puffs of a sub-frame share.
struct PuffLight {
  const OpacityGrid& grid;
  const FrameUniforms& frame;
  SkyModel sky;
  Vector3f to_sun;

  PuffLight(const OpacityGrid& opacity, const FrameUniforms& frame_uniforms, const Vector3f& sun_direction);
  /// `visibility`: share of the sun that the scene lets through.
  PuffRadiance radiance(const Vector3f& place, float radius, const Vector3f& albedo, float visibility,
                        const Vector3f& to_eye) const;
  /// Light of the sky on a white surface with this normal, and what one this rough mirrors from a direction:
  /// as in shaders/sky.glsl.
  Vector3f ambient(const Vector3f& normal) const;
  Vector3f sky_reflection(const Vector3f& direction, float roughness) const;
  /// Radiance of a white thing so small that it is lit by lamps from all sides.
  Vector3f lamps_around(const Vector3f& place) const;
  /// Light added on the way to the eye, and in w the share that arrives: as fog_to in shaders/sky.glsl.
  Vector4f fog_to(const Vector3f& place) const;
};

}  // namespace offstage::render
