#pragma once
/// The colour of glowing bodies: fire, sparks, embers.

#include <Eigen/Core>

namespace offstage::effects {

/// Linear sRGB colour of luminance 1 of a black body at a temperature, which is clamped to [500, 15 000] K:
/// Planck's law seen by the CIE 1931 observer, interpolated in a table. Colours outside of the sRGB gamut,
/// such as those below 1900 K, lose their negative components and keep their luminance.
Eigen::Vector3f blackbody_color(float kelvin);

/// Ratio of the luminance of a black body at `kelvin` to that at `reference`. It decreases fast: at 1000 K it
/// is 1/40 000 of that at 1800 K.
float blackbody_brightness(float kelvin, float reference);

}  // namespace offstage::effects
