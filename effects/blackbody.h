#pragma once
/// The colour of glowing bodies: fire, sparks, embers.

#include <Eigen/Core>

namespace offstage::effects {

/// Linear sRGB of a black body at a temperature in [500, 15 000] K, clamped to it, of luminance 1: Planck's
/// law under the CIE 1931 observer, interpolated in a table. Colours that sRGB does not hold, as of anything
/// below 1900 K, lose what is negative and keep their luminance.
Eigen::Vector3f blackbody_color(float kelvin);

/// How much brighter than at `reference` a black body is at `kelvin`: the ratio of luminances. It falls
/// off fast: at 1000 K it is 1/40 000 of that at 1800 K.
float blackbody_brightness(float kelvin, float reference);

}  // namespace offstage::effects
