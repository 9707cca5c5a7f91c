#pragma once
/// The number, vector and pose types of the simulation. SI units, right-handed frames, Y up.

#include <limits>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace offstage::sim {

using Real = double;
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaterniond;

inline constexpr Real kInfinity = std::numeric_limits<Real>::infinity();

/// A rigid placement: maps body coordinates to world coordinates (world_from_body).
struct Pose {
  Vec3 position = Vec3::Zero();         ///< world position of the body's origin [m]
  Quat orientation = Quat::Identity();  ///< unit quaternion, body to world

  Vec3 point_to_world(const Vec3& p) const { return orientation * p + position; }
  Vec3 point_to_body(const Vec3& p) const { return orientation.conjugate() * (p - position); }
  Vec3 vector_to_world(const Vec3& v) const { return orientation * v; }
  Vec3 vector_to_body(const Vec3& v) const { return orientation.conjugate() * v; }
};

/// Axis-aligned box in world coordinates; empty when low > high in any axis.
using Aabb = Eigen::AlignedBox3d;

}  // namespace offstage::sim
