#pragma once
/// Private: the sky on the CPU, equal to shaders/sky.glsl, and its irradiance (Ramamoorthi and Hanrahan, "An
/// Efficient Representation for Irradiance Environment Maps", 2001).

#include <array>

#include "render/stage.h"

namespace offstage::render {

struct SkyModel {
  Vector3f sun_direction;
  Vector3f zenith, horizon, ground;
  Vector3f glow;  ///< radiance around the sun
};

SkyModel make_sky(const Sun& sun, const Environment& environment);

/// Radiance of the sky from a unit direction, without the sun's disc.
Vector3f sky_radiance(const SkyModel& sky, const Vector3f& direction);

/// Spherical-harmonics coefficients of the sky's irradiance. The radiance of a white diffuse surface with
/// normal (x, y, z) is their sum weighted by 1, y, z, x, xy, yz, 3zz - 1, xz, xx - yy.
std::array<Vector3f, 9> sky_irradiance(const SkyModel& sky);

}  // namespace offstage::render
