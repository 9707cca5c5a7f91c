#include "effects/blackbody.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace offstage::effects {
namespace {

using Eigen::Vector3d;

constexpr int kEntries = 512;
constexpr double kColdest = 500, kHottest = 15'000;

/// Returns a Gaussian lobe with different widths below and above its middle; all arguments in [nm].
double lobe(double wavelength, double middle, double below, double above) {
  const double t = (wavelength - middle) * (wavelength < middle ? below : above);
  return std::exp(-t * t / 2);
}

/// The CIE 1931 standard observer, approximated by the lobes of Wyman, Sloan and Shirley, "Simple analytic
/// approximations to the CIE XYZ color matching functions", JCGT 2013.
Vector3d observer(double nm) {
  return {0.362 * lobe(nm, 442.0, 0.0624, 0.0374) + 1.056 * lobe(nm, 599.8, 0.0264, 0.0323) -
              0.065 * lobe(nm, 501.1, 0.0490, 0.0382),
          0.821 * lobe(nm, 568.8, 0.0213, 0.0247) + 0.286 * lobe(nm, 530.9, 0.0613, 0.0322),
          1.217 * lobe(nm, 437.0, 0.0845, 0.0278) + 0.681 * lobe(nm, 459.0, 0.0385, 0.0725)};
}

/// Returns the spectral radiance by Planck's law, without the constant factor.
double radiance(double nm, double kelvin) {
  const double second_constant = 1.438776877e7;  // h c / k [nm K]
  return std::pow(nm / 560, -5) / std::expm1(second_constant / (nm * kelvin));
}

/// Returns the colour of a black body as X, Y, Z, without a constant factor.
Vector3d seen(double kelvin) {
  Vector3d sum = Vector3d::Zero();
  for (double nm = 360; nm <= 830; nm += 5) sum += radiance(nm, kelvin) * observer(nm);
  return sum;
}

struct Entry {
  Eigen::Vector3f color;
  double log_luminance;
};

Entry entry(double kelvin) {
  Eigen::Matrix3d rgb_from_xyz;
  rgb_from_xyz << 3.2404542, -1.5371385, -0.4985314, -0.9692660, 1.8760108, 0.0415560, 0.0556434, -0.2040259,
      1.0572252;
  const Vector3d xyz = seen(kelvin), rgb = (rgb_from_xyz * xyz).cwiseMax(0);
  const double luminance = rgb.dot(Vector3d(0.2126729, 0.7151522, 0.0721750));
  return {(rgb / luminance).cast<float>(), std::log(xyz.y())};
}

/// Returns the table of colours. Its entries are equally spaced in the inverse temperature, because colour
/// and the logarithm of luminance are nearly linear functions of it.
const std::array<Entry, kEntries>& table() {
  static const std::array<Entry, kEntries> entries = [] {
    std::array<Entry, kEntries> made;
    for (int i = 0; i < kEntries; ++i)
      made[static_cast<std::size_t>(i)] =
          entry(1 / (1 / kColdest + (1 / kHottest - 1 / kColdest) * i / (kEntries - 1)));
    return made;
  }();
  return entries;
}

/// Position of a temperature in the table: the entry below it, and the fraction of the way to the next entry.
struct Spot {
  std::size_t i;
  double part;
};

Spot spot(float kelvin) {
  const double t = std::clamp(static_cast<double>(kelvin), kColdest, kHottest);
  const double x = (1 / kColdest - 1 / t) / (1 / kColdest - 1 / kHottest) * (kEntries - 1);
  const auto i = static_cast<std::size_t>(std::clamp(x, 0.0, kEntries - 2.0));
  return {i, x - static_cast<double>(i)};
}

double log_luminance(float kelvin) {
  const Spot s = spot(kelvin);
  return table()[s.i].log_luminance * (1 - s.part) + table()[s.i + 1].log_luminance * s.part;
}

}  // namespace

Eigen::Vector3f blackbody_color(float kelvin) {
  const Spot s = spot(kelvin);
  const auto w = static_cast<float>(s.part);
  return table()[s.i].color * (1 - w) + table()[s.i + 1].color * w;
}

float blackbody_brightness(float kelvin, float reference) {
  return static_cast<float>(std::exp(log_luminance(kelvin) - log_luminance(reference)));
}

}  // namespace offstage::effects
