#include "render/lamps.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace offstage::render {

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
  // Flames hide each other, so their total visible area is at most the area of one side of the box around
  // them.
  constexpr float kCover = 0.6f;  // fraction of a flame's disc that is covered
  constexpr float kDimmed = 4;  // flames are drawn darker than they are, because otherwise all would be white
  const Vector3f sizes = flames.box.sizes();
  const float side = 0.5f * sizes.y() * (sizes.x() + sizes.z());
  const float shown =
      side * (1 - std::exp(-kCover * std::numbers::pi_v<float> * area / std::max(side, 1e-6f)));
  return {.position = place / area,
          .intensity = kDimmed * light / area * (shown / std::numbers::pi_v<float>),
          .radius = 0.25f * std::min(sizes.x(), sizes.y()),
          .in_mirrors = true};
}

}  // namespace offstage::render
