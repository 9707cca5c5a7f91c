#include "render/trace/light_sources.h"

#include <cmath>
#include <numbers>

namespace offstage::render {

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
