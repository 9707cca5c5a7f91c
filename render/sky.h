#pragma once
/// Private: the sky on the CPU, equal to shaders/sky.glsl, and its irradiance (Ramamoorthi and Hanrahan, "An
/// Efficient Representation for Irradiance Environment Maps", 2001).

#include <array>

#include "render/sky_picture.h"
#include "render/stage.h"

namespace offstage::render {

struct SkyModel {
  Vector3f sun_direction;
  Vector3f zenith, horizon, ground;
  Vector3f glow;          ///< radiance around the sun
  TurnedSky turned = {};  ///< the picture that replaces the colours
  bool has_bright_part() const { return turned.picture && turned.picture->has_bright_part(); }
  /// Whether the picture only gives light, while the background and the fog show the colours.
  bool seen_as_colors = false;
};

SkyModel make_sky(const Sun& sun, const Environment& environment);

/// Returns the radiance of the sky from a unit direction, without the sun's disc. For a picture, it is the
/// sum of the dim and the bright part.
Vector3f sky_radiance(const SkyModel& sky, const Vector3f& direction);

/// Returns the radiance of the colour gradient of the sky, even if a picture replaces it.
Vector3f gradient_radiance(const SkyModel& sky, const Vector3f& direction);

/// Returns the sky light that a surface with this roughness reflects. `direction`: the mirrored direction;
/// `ambient`: light on a white surface whose normal is `direction`. Equal to sky_reflection() in
/// shaders/sky.glsl.
Vector3f sky_mirrored(const SkyModel& sky, const Vector3f& direction, float roughness,
                      const Vector3f& ambient);

/// Returns the colour of fog in a direction, as horizon_color() in shaders/sky.glsl.
Vector3f horizon_color(const SkyModel& sky, const Vector3f& direction);

/// Returns the values of nine functions at the unit direction n: the real spherical harmonics up to order 2,
/// without their constants. sky_irradiance() gives the weights of these functions. shaders/sky.glsl computes
/// the same values.
std::array<float, 9> sky_basis(const Vector3f& n);

/// Returns the spherical-harmonics coefficients of the sky's irradiance. The radiance of a white diffuse
/// surface with normal (x, y, z) is their sum weighted by 1, y, z, x, xy, yz, 3zz - 1, xz, xx - yy.
std::array<Vector3f, 9> sky_irradiance(const SkyModel& sky);

}  // namespace offstage::render
