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

/// The lighting that all puffs of a sub-frame share.
struct PuffLight {
  const OpacityGrid& grid;
  const FrameUniforms& frame;
  const AirLight& air;
  const AirField& around;
  SkyModel sky;
  Vector3f to_sun;

  /// Prepares the lighting of a sub-frame. `sky_model` must have the direction of the sun in this sub-frame.
  PuffLight(const OpacityGrid& opacity, const FrameUniforms& frame_uniforms, const SkyModel& sky_model,
            const Vector3f& sun_direction, const AirLight& air_light, const AirField& light_around);
  /// Returns the radiance of a white puff at a place, as a function of the normal of its surface. `number`:
  /// see AirLight::sun.
  AirRadiance radiance(const Vector3f& place, float radius, const Vector3f& albedo, float number,
                       const Vector3f& to_eye) const;
  /// Returns the sky light on a white surface with this normal, as in shaders/sky.glsl.
  Vector3f ambient(const Vector3f& normal) const;
  /// Returns the sky light that a surface with this roughness reflects. `direction`: the mirrored direction.
  Vector3f sky_reflection(const Vector3f& direction, float roughness) const;
  /// Returns the light that fog adds between a point and the eye; w: the transmittance of the fog. Equal to
  /// fog_to in shaders/sky.glsl.
  Vector4f fog_to(const Vector3f& place) const;
};

}  // namespace offstage::render
