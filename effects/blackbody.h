#pragma once
/// Colour and brightness of glowing matter such as fire, sparks and embers.

#include <Eigen/Core>

namespace offstage::effects {

/// Returns the linear sRGB colour of a black body, scaled to the luminance 1. `kelvin`: temperature, clamped
/// to [500, 15 000] K. The colour follows from Planck's law and the CIE 1931 observer, interpolated in a
/// table. Colours outside of the sRGB gamut, such as those below 1900 K, lose their negative components and
/// keep their luminance.
Eigen::Vector3f blackbody_color(float kelvin);

/// Returns the luminance of a black body at the temperature `kelvin`, divided by its luminance at the
/// temperature `reference` [K]. The luminance increases steeply with the temperature: at 1000 K it is 1/40
/// 000 of its value at 1800 K.
float blackbody_brightness(float kelvin, float reference);

}  // namespace offstage::effects
