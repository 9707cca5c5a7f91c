#pragma once
/// Private: a direction in one number of a picture, and the relief in the light of lamps. The same functions
/// are in shaders/traced.glsl.

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

namespace offstage::render {

/// Number of values of each of two coordinates.
inline constexpr float kDirectionSteps = 4095;
/// Greatest factor by which relief increases the light of lamps. At grazing light it would have no limit.
inline constexpr float kMostRelief = 3;

/// Returns the direction of a vector as a whole number from 1 to 2^24, which a float holds exactly: two
/// coordinates on an octahedron that is unfolded to a square (Q. Meyer et al., "On Floating-Point Normal
/// Vectors", 2010). The error is at most 0.001 rad. 0 for the zero vector.
inline float packed_direction(const Eigen::Vector3f& v) {
  const float size = v.cwiseAbs().sum();
  if (!(size > 0)) return 0;
  const auto sign = [](float x) { return x < 0 ? -1.0f : 1.0f; };
  Eigen::Vector2f p = v.head<2>() / size;
  if (v.z() < 0)
    p = Eigen::Vector2f((1 - std::abs(p.y())) * sign(p.x()), (1 - std::abs(p.x())) * sign(p.y()));
  const auto step = [](float x) { return std::round((0.5f + 0.5f * x) * (kDirectionSteps - 1)); };
  return 1 + step(p.x()) + kDirectionSteps * step(p.y());
}

/// Returns the unit vector of packed_direction(), or zero.
inline Eigen::Vector3f unpacked_direction(float packed) {
  if (packed < 0.5f) return Eigen::Vector3f::Zero();
  const float row = std::floor((packed - 1) / kDirectionSteps), half = (kDirectionSteps - 1) / 2;
  const Eigen::Vector2f p((packed - 1 - kDirectionSteps * row) / half - 1, row / half - 1);
  Eigen::Vector3f v(p.x(), p.y(), 1 - std::abs(p.x()) - std::abs(p.y()));
  if (v.z() < 0) {
    v.x() = (1 - std::abs(p.y())) * (p.x() < 0 ? -1.0f : 1.0f);
    v.y() = (1 - std::abs(p.x())) * (p.y() < 0 ? -1.0f : 1.0f);
  }
  return v.normalized();
}

/// Returns the factor by which the diffuse light of lamps in the mean direction `towards` changes if the unit
/// normal is `normal` instead of `traced`.
inline float lamp_relief(const Eigen::Vector3f& towards, const Eigen::Vector3f& traced,
                         const Eigen::Vector3f& normal) {
  const float cosine = traced.dot(towards);
  return cosine > 0 ? std::min(std::max(normal.dot(towards), 0.0f) / cosine, kMostRelief) : 1;
}

}  // namespace offstage::render
