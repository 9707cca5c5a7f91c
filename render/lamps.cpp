#include "render/lamps.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace offstage::render {
namespace {

float power(const Lamp& lamp) {
  return lamp.intensity.sum();
}

/// Point of the ball or rectangle that emits the light in a sub-frame.
Vector3f place_in(const Lamp& lamp, const Vector3f& right, const Vector3f& up, const SampleOffsets& offsets) {
  if (lamp.size.x() > 0)
    return lamp.position + offsets.light.x() * lamp.size.x() * right + offsets.light.y() * lamp.size.y() * up;
  const Vector2f disc = square_to_disc(offsets.light);
  const float height = 2 * offsets.pixel.x() * std::sqrt(std::max(1 - disc.squaredNorm(), 0.0f));
  return lamp.position + lamp.radius * (disc.x() * right + disc.y() * up + height * right.cross(up));
}

}  // namespace

Lamp lamp_of_fire(const PointSet& flames) {
  Vector3f place = Vector3f::Zero(), light = Vector3f::Zero();
  float area = 0;
  for (const GpuPoint& p : flames.points) {
    const float seen = p.position.w() * p.position.w() * std::min(p.color.w(), 1.0f);
    area += seen;
    place += seen * p.position.head<3>();
    light += seen * p.color.head<3>();
  }
  if (area <= 0) return {.intensity = Vector3f::Zero()};
  // Flames hide each other: their total visible area is at most one side of the box around them.
  constexpr float kCover = 0.6f;  // share of a flame's disc that is covered
  constexpr float kDimmed = 4;  // flames are drawn darker than they are, because otherwise all would be white
  const Vector3f sizes = flames.box.sizes();
  const float side = 0.5f * sizes.y() * (sizes.x() + sizes.z());
  const float shown =
      side * (1 - std::exp(-kCover * std::numbers::pi_v<float> * area / std::max(side, 1e-6f)));
  return {.position = place / area,
          .intensity = kDimmed * light / area * (shown / std::numbers::pi_v<float>),
          .radius = 0.25f * std::min(sizes.x(), sizes.y())};
}

Vector3f lamp_radiance(const LampUniforms& lamp, const Vector3f& place, Vector3f& towards) {
  const Vector3f v = lamp.position.head<3>() - place;
  towards = v.normalized();
  const float share =
      std::clamp(lamp.right.w() - lamp.direction.w() * towards.dot(lamp.direction.head<3>()), 0.0f, 1.0f);
  const float radius = lamp.position.w();
  return lamp.intensity.head<3>() * (share / (v.squaredNorm() + 0.25f * radius * radius));
}

void prepare_lamp_uniforms(std::span<const Lamp> lamps, const SampleOffsets& offsets, FrameUniforms& frame) {
  std::vector<const Lamp*> chosen;
  for (const Lamp& lamp : lamps)
    if (power(lamp) > 0) chosen.push_back(&lamp);
  std::stable_sort(chosen.begin(), chosen.end(),
                   [](const Lamp* a, const Lamp* b) { return power(*a) > power(*b); });
  chosen.resize(std::min(chosen.size(), kMostLamps));
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const Lamp& lamp = *chosen[k];
    LampUniforms& u = frame.lamps[k];
    const Vector3f forward = lamp.direction.normalized();
    const Vector3f other = std::abs(forward.y()) < 0.99f ? Vector3f::UnitY() : Vector3f::UnitX();
    const Vector3f right = other.cross(forward).normalized(), up = forward.cross(right);
    const bool cone = lamp.cone_deg > 0, area = lamp.size.x() > 0;
    u.position << place_in(lamp, right, up, offsets), lamp.radius;
    u.intensity << lamp.intensity, 0;
    u.direction << forward, area ? 1.0f : 0.0f;
    u.right << right, area ? 0.0f : 1.0f;
    if (cone) {
      const float half = 0.5f * lamp.cone_deg * std::numbers::pi_v<float> / 180;
      const float edge = std::cos(half), full = std::cos(half * (1 - std::clamp(lamp.softness, 0.02f, 1.0f)));
      u.direction.w() = 1 / (full - edge);
      u.right.w() = -edge / (full - edge);
    }
  }
  frame.air.x() = static_cast<float>(chosen.size());
}

}  // namespace offstage::render
