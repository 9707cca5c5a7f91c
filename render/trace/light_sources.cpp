#include "render/trace/light_sources.h"

#include <cmath>
#include <numbers>

#include <Eigen/LU>

namespace offstage::render {

bool GlassPiece::contains(const Vector3f& place, float margin_m) const {
  const Vector3f at = edges.inverse() * (place - corner);
  for (int k = 0; k < 3; ++k) {
    const float margin = margin_m / edges.col(k).norm();
    if (!(at[k] >= -margin && at[k] <= 1 + margin)) return false;
  }
  return true;
}

SunDisc::SunDisc(const Sun& sun, const Vector3f& direction) : middle_(direction) {
  const float radius = std::tan(0.5f * sun.size_deg * std::numbers::pi_v<float> / 180);
  Three<float> a, b;
  make_basis(from_eigen(direction), a, b);
  across_ = radius * to_eigen(a);
  along_ = radius * to_eigen(b);
}

Vector3f SunDisc::direction(const SquarePoint<float>& uv) const {
  const SquarePoint<float> d = on_disc(uv);
  return (middle_ + d.x * across_ + d.y * along_).normalized();
}

LaneVectors SunDisc::direction(const SquarePoint<Lanes>& uv) const {
  const SquarePoint<Lanes> d = on_disc(uv);
  return normalized(all_lanes(middle_) + all_lanes(across_) * d.x + all_lanes(along_) * d.y);
}

}  // namespace offstage::render
