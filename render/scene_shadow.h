#pragma once
/// Private: the share of sunlight that the scene lets through to a particle that is lit on the CPU. Uses a
/// copy of the shadow map.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "render/shadow_map.h"

namespace offstage::render {

class SceneShadow {
 public:
  void read(const ShadowMap& map, const FrameUniforms& frame, const Eigen::AlignedBox3f& box) {
    lit_ = frame.sun_direction.w() == 0;
    if (lit_) return;
    for (int row = 0; row < 3; ++row)
      map_from_world_.row(row) = frame.shadow_rows[static_cast<std::size_t>(row)].transpose();
    size_px_ = static_cast<float>(map.size_px());
    Eigen::AlignedBox2f seen;
    for (int k = 0; k < 8; ++k)
      seen.extend(texel_of(box.corner(static_cast<Eigen::AlignedBox3f::CornerType>(k))).head<2>());
    const auto clamped = [this](float x) { return static_cast<int>(std::clamp(x, 0.0f, size_px_)); };
    x0_ = clamped(std::floor(seen.min().x()) - 1);
    y0_ = clamped(std::floor(seen.min().y()) - 1);
    width_ = clamped(std::ceil(seen.max().x()) + 1) - x0_;
    height_ = clamped(std::ceil(seen.max().y()) + 1) - y0_;
    lit_ = width_ <= 0 || height_ <= 0;
    if (!lit_) map.read(x0_, y0_, width_, height_, depths_);
  }
  float visibility(const Vector3f& place, float radius) const {
    if (lit_) return 1;
    float sum = at(place);
    for (int k = 0; k < 3; ++k)
      for (const float side : {-0.6f, 0.6f}) sum += at(place + side * radius * Vector3f::Unit(k));
    return sum / 7;
  }
  float visibility(const Vector3f& place) const { return lit_ ? 1 : at(place); }

 private:
  Vector3f texel_of(const Vector3f& place) const {
    Vector3f p = map_from_world_ * place.homogeneous();
    p.head<2>() *= size_px_;
    return p;
  }
  float at(const Vector3f& place) const {
    const Vector3f p = texel_of(place);
    const int x = static_cast<int>(std::floor(p.x())) - x0_, y = static_cast<int>(std::floor(p.y())) - y0_;
    if (x < 0 || y < 0 || x >= width_ || y >= height_) return 1;
    const auto depth = static_cast<float>(depths_[static_cast<std::size_t>(y * width_ + x)]);
    return std::clamp(p.z(), 0.0f, 1.0f) * 65535 <= depth + 0.5f ? 1.0f : 0.0f;
  }

  Eigen::Matrix<float, 3, 4> map_from_world_ = Eigen::Matrix<float, 3, 4>::Identity();
  float size_px_ = 0;
  int x0_ = 0, y0_ = 0, width_ = 0, height_ = 0;
  bool lit_ = true;
  std::vector<uint16_t> depths_;
};

}  // namespace offstage::render
