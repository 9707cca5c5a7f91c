#pragma once
/// Private: computes the light of puffs and drops. The radiance of a puff is a linear function of its normal,
/// so that a pixel needs few operations. Multiple scattering brings light deeper into smoke than single
/// scattering. It is approximated by a sum of weaker terms with slower attenuation (Wrenninge, Kulla and
/// Lundqvist, "Oz: The Great and Volumetric", 2013).

#include "render/frame.h"
#include "render/opacity_grid.h"
#include "render/sky.h"
#include "render/trace/air_field.h"
#include "render/trace/air_light.h"

namespace offstage::render {

/// Light of the sun that a drop scatters: to all sides, and in the direction of the rays.
inline constexpr float kDropAround = 0.12f, kDropForward = 0.9f;

/// The lighting that all puffs of a sub-frame share, in the picture and in mirror images.
struct SmokeLight {
  const OpacityGrid& grid;
  const AirLight& air;
  const AirField& around;
  Vector3f to_sun, sun_radiance;

  /// Returns the light that a white puff scatters. `number`: see AirLight::sun.
  ParticleLight of_puff(const Vector3f& place, float radius, const Vector3f& albedo, float number) const;
  /// Returns the light that another white particle scatters, as shaders/points.vert and drop_light() in
  /// streaks_pass.cpp compute it.
  ParticleLight of_particle(Scattering scattering, const Vector3f& place, float radius, float number) const;
};

/// The lighting that all particles in the picture of a sub-frame share. The direction of the sun in the model
/// of the sky must be that of this sub-frame.
struct PuffLight : SmokeLight {
  const FrameUniforms& frame;
  SkyModel sky;

  /// Returns the sky light on a white surface with this normal, as in shaders/sky.glsl.
  Vector3f ambient(const Vector3f& normal) const;
  /// Returns the sky light that a surface with this roughness reflects. `direction`: the mirrored direction.
  Vector3f sky_reflection(const Vector3f& direction, float roughness) const;
  /// Returns the light that fog adds between a point and the eye; w: the transmittance of the fog. Equal to
  /// fog_to in shaders/sky.glsl.
  Vector4f fog_to(const Vector3f& place) const;
};

}  // namespace offstage::render
