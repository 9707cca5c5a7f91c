#include "render/sky.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace offstage::render {

SkyModel make_sky(const Sun& sun, const Environment& environment) {
  constexpr float kGlow = 0.12f;  // fraction of the sun's radiance
  const Vector3f direction = sun.direction.normalized();
  const float risen = std::clamp(0.5f + 5 * direction.y(), 0.0f, 1.0f);
  SkyModel sky{.sun_direction = direction,
               .zenith = environment.intensity * environment.zenith,
               .horizon = environment.intensity * environment.horizon,
               .ground = environment.intensity * environment.ground,
               .glow = environment.intensity * kGlow * risen * sun.intensity * sun.color};
  if (environment.ground_albedo) {
    // Horizontal ground gets light from the whole sky. kLow is the mean of the gradient, weighted by the
    // cosine.
    constexpr float kLow = 0.066f;
    const Vector3f light = sky.zenith + kLow * (sky.horizon - sky.zenith) +
                           std::max(direction.y(), 0.0f) * sun.intensity * sun.color;
    sky.ground = environment.ground_albedo->cwiseProduct(light);
  }
  if (environment.picture) {
    sky.turned = {environment.picture, environment.picture_turn_deg * std::numbers::pi_v<float> / 180,
                  environment.intensity};
    sky.glow.setZero();
    sky.seen_as_colors = !environment.picture_visible;
  }
  return sky;
}

Vector3f sky_radiance(const SkyModel& sky, const Vector3f& direction) {
  if (!sky.turned.picture) return gradient_radiance(sky, direction);
  return sky.turned.intensity * sky.turned.picture->seen(sky.turned.to_picture(direction));
}

Vector3f gradient_radiance(const SkyModel& sky, const Vector3f& direction) {
  if (direction.y() < 0) return sky.ground;
  const float u = 1 - std::min(direction.y(), 1.0f), u2 = u * u, u4 = u2 * u2;
  const float low = 0.3f * u2 + 0.7f * u4 * u4;
  const float x = std::max(direction.dot(sky.sun_direction), 0.0f);
  const float x2 = x * x, x4 = x2 * x2, x8 = x4 * x4, x16 = x8 * x8, x64 = x16 * x16 * x16 * x16;
  return sky.zenith + low * (sky.horizon - sky.zenith) + (0.25f * x8 + 0.75f * x64) * sky.glow;
}

Vector3f sky_mirrored(const SkyModel& sky, const Vector3f& direction, float roughness,
                      const Vector3f& ambient) {
  if (sky.turned.picture)
    return sky.turned.intensity * sky.turned.picture->mirrored(sky.turned.to_picture(direction), roughness);
  const float blur = 0.02f + 0.5f * roughness;
  const float t = std::clamp((blur - direction.y()) / (2 * blur), 0.0f, 1.0f), below = t * t * (3 - 2 * t);
  const Vector3f above =
      gradient_radiance(sky, Vector3f(direction.x(), std::max(direction.y(), 0.0f), direction.z()));
  const Vector3f sharp = above + below * (sky.ground - above);
  return sharp + roughness * roughness * (ambient - sharp);
}

Vector3f horizon_color(const SkyModel& sky, const Vector3f& direction) {
  const Vector3f level = Vector3f(direction.x(), std::max(direction.y(), 0.0f), direction.z()).normalized();
  if (!sky.turned.picture || sky.seen_as_colors) return gradient_radiance(sky, level);
  constexpr float kRoughnessOfHaze = 0.5f;
  return sky.turned.intensity * sky.turned.picture->mirrored(sky.turned.to_picture(level), kRoughnessOfHaze);
}

std::array<float, 9> sky_basis(const Vector3f& n) {
  return {1,
          n.y(),
          n.z(),
          n.x(),
          n.x() * n.y(),
          n.y() * n.z(),
          3 * n.z() * n.z() - 1,
          n.x() * n.z(),
          n.x() * n.x() - n.y() * n.y()};
}

std::array<Vector3f, 9> sky_irradiance(const SkyModel& sky) {
  if (sky.turned.picture) return sky.turned.irradiance();
  // Factors of the nine functions: the squares of the constants of the real spherical harmonics, times the
  // factors of the cosine lobe divided by pi (1, 2/3, 1/4).
  constexpr float pi = std::numbers::pi_v<float>;
  constexpr std::array<float, 9> kWeights = {1 / (4 * pi),     0.5f / pi,      0.5f / pi,
                                             0.5f / pi,        3.75f / pi / 4, 3.75f / pi / 4,
                                             0.3125f / pi / 4, 3.75f / pi / 4, 0.9375f / pi / 4};
  constexpr int kBands = 32, kColumns = 48;
  std::array<Vector3f, 9> sum;
  sum.fill(Vector3f::Zero());
  for (int band = 0; band < kBands; ++band) {
    const float y = (static_cast<float>(band) + 0.5f) * 2 / kBands - 1;  // bands of equal area
    const float r = std::sqrt(1 - y * y);
    for (int column = 0; column < kColumns; ++column) {
      const float angle = (static_cast<float>(column) + 0.5f) * 2 * pi / kColumns;
      const float x = r * std::cos(angle), z = r * std::sin(angle);
      const Vector3f radiance = gradient_radiance(sky, {x, y, z});
      const std::array<float, 9> basis = sky_basis({x, y, z});
      for (std::size_t k = 0; k < 9; ++k) sum[k] += basis[k] * radiance;
    }
  }
  constexpr float kSolidAngle = 4 * pi / (kBands * kColumns);
  // Light that is reflected from surface to surface loses some of the sky's blue.
  constexpr float kGrey = 0.35f;
  const Vector3f luminance(0.2126f, 0.7152f, 0.0722f);
  for (std::size_t k = 0; k < 9; ++k) {
    sum[k] *= kWeights[k] * kSolidAngle;
    sum[k] += kGrey * (Vector3f::Constant(luminance.dot(sum[k])) - sum[k]);
  }
  return sum;
}

}  // namespace offstage::render
