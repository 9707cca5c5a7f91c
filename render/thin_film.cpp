#include "render/thin_film.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace offstage::render {
namespace {

using Eigen::Array3d;
using std::numbers::pi;

/// Returns the Fresnel reflectance at perpendicular incidence.
double reflectance_between(double n1, double n2) {
  const double r = (n1 - n2) / (n1 + n2);
  return r * r;
}

/// Returns the index of refraction, relative to air, of a surface with this reflectance, which must be below
/// 1.
double index_of_refraction(double reflectance) {
  const double root = std::sqrt(std::clamp(reflectance, 0.0, 0.9999));
  return (1 + root) / (1 - root);
}

/// Returns the Fourier transform of the eye's sensitivity as a function of the wave number, as linear RGB.
/// `path_m`: path difference; `shift`: phase shift of each channel [rad]. If both are 0, the result is about
/// (1, 1, 1).
Array3d film_sensitivity(double path_m, const Array3d& shift) {
  const double phase = 2 * pi * path_m;
  const Array3d value(5.4856e-13, 4.4201e-13, 5.2481e-13), place(1.6810e6, 1.7953e6, 2.2084e6),
      variance(4.3278e9, 9.3046e9, 6.6121e9);
  Array3d xyz =
      value * (2 * pi * variance).sqrt() * (place * phase + shift).cos() * (-phase * phase * variance).exp();
  xyz[0] += 9.7470e-14 * std::sqrt(2 * pi * 4.5282e9) * std::cos(2.2399e6 * phase + shift[0]) *
            std::exp(-4.5282e9 * phase * phase);  // the second maximum of the curve X
  Eigen::Matrix3d rgb_from_xyz;
  rgb_from_xyz << 3.2404542, -1.5371385, -0.4985314, -0.9692660, 1.8760108, 0.0415560, 0.0556434, -0.2040259,
      1.0572252;
  // For the fit, light of equal energy is white. The factors convert this white to the RGB colour (1, 1, 1).
  return rgb_from_xyz.array().rowwise().sum().inverse() * (rgb_from_xyz * (xyz / 1.0685e-7).matrix()).array();
}

}  // namespace

Vector3f film_reflectance(double n, double thickness_nm, const Vector3f& base) {
  const double top = reflectance_between(1, n), entering = 1 - top;
  Array3d bottom, shift;
  for (int k = 0; k < 3; ++k) {
    const double below = index_of_refraction(double{base[k]});
    bottom[k] = reflectance_between(n, below);
    shift[k] = pi + (below < n ? pi : 0);  // the first term belongs to the upper surface, seen from the
                                           // inside; the second one to the base
  }
  const Array3d both = (top * bottom).max(1e-5).min(0.9999), r = both.sqrt();
  const Array3d once = entering * entering * bottom / (1 - both);
  Array3d light = top + once, order = once - entering;
  for (int m = 1; m <= 2; ++m) {
    order *= r;
    light += order * 2 * film_sensitivity(m * 2 * n * thickness_nm * 1e-9, m * shift);
  }
  return light.max(0).min(1).matrix().cast<float>();
}

}  // namespace offstage::render
