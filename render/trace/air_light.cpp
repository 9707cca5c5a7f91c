#include "render/trace/air_light.h"

namespace offstage::render {
namespace {

/// Returns the 24 bits of a number in [0, 1).
uint32_t bits_of(float number) {
  return static_cast<uint32_t>(number * 0x1p24f);
}

}  // namespace

PixelSampler AirLight::sampler_of(float number) const {
  const uint32_t bits = bits_of(number);
  return {bits >> 8, bits & 255, offsets_.index, offsets_.count};
}

// Traces eight rays from the front of the ball. They use the samples of eight neighbouring pixels.
float AirLight::sun(const Vector3f& center, float radius, float number) const {
  if (sources_.sun.intensity <= 0) return 0;
  if (!sources_.sun.shadows) return 1;
  const uint32_t bits = bits_of(number);
  const UintLanes x = UintLanes{0, 1, 2, 3, 0, 1, 2, 3} + 4 * (bits >> 10);
  const UintLanes y = UintLanes{0, 0, 0, 0, 1, 1, 1, 1} + 2 * (bits & 1023);
  Sampler<UintLanes> sampler(x, y, offsets_.index, offsets_.count);
  const LaneVectors towards = disc_.direction(sampler.next());
  const SquarePoint<Lanes> d = on_disc(sampler.next());
  const Vector3f& to_sun = sources_.sky.sun_direction;
  Three<float> a, b;
  make_basis(from_eigen(to_sun), a, b);
  const float wide = 0.6f * radius;
  const LaneVectors from = all_lanes(center + radius * to_sun) + all_lanes(to_eigen(a)) * (wide * d.x) +
                           all_lanes(to_eigen(b)) * (wide * d.y);
  const LaneVectors seen = scene_.transmittance(from, towards, Lanes{} + 1e9f, IntLanes{} - 1);
  float sum = 0;
  for (int i = 0; i < kLanes; ++i) sum += seen.x[i] + seen.y[i] + seen.z[i];
  return sum / (3 * kLanes);
}

Vector3f AirLight::lamps_around(const Vector3f& center, float radius, float number) const {
  constexpr float kFraction = 0.3f;
  Vector3f sum = Vector3f::Zero();
  for_each_lamp(center, radius, number, [&](const Vector3f& light, const Vector3f&) { sum += light; });
  return kFraction * sum;
}

}  // namespace offstage::render
