#pragma once
/// Private: colours of thin films, such as soap and oil.

#include "render/mesh.h"

namespace offstage::render {

/// Returns the reflectance at perpendicular incidence of a transparent film in air on a base, by the
/// interference of up to three reflections, in linear RGB. `n`: index of refraction of the film, at least 1.
/// `thickness_nm`: [nm], at least 0. `base`: reflectance of the base in air, in [0, 1]; it has no absorption.
/// From L. Belcour and P. Barla, "A Practical Extension to Microfacet Theory for the Modeling of Varying
/// Iridescence" (2017), with their fit of the eye's sensitivity.
Vector3f film_reflectance(double n, double thickness_nm, const Vector3f& base);

}  // namespace offstage::render
