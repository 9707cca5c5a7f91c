#pragma once
/// Keyframed motion of kinematic bodies (physics E8, N6): positions linear or smooth, orientations by slerp,
/// and the velocities that belong to the interpolation.

#include <vector>

#include "sim/types.h"

namespace offstage::sim {

struct Keyframe {
  Real time = 0;  ///< [s]
  Pose pose;
};

enum class Interpolation {
  linear,  ///< constant velocity between keys
  smooth,  ///< cubic Hermite through the keys with Catmull-Rom tangents: continuous velocity
};

/// A pose with the velocities of the motion through it.
struct Motion {
  Pose pose;
  Vec3 velocity = Vec3::Zero();          ///< of the origin, world [m/s]
  Vec3 angular_velocity = Vec3::Zero();  ///< world [rad/s]
};

/// Key poses over time, plus an optional constant spin on top (for wheels and gears, where keys would be
/// many).
struct KeyframeTrack {
  std::vector<Keyframe> keys;  ///< strictly increasing times; empty: rests at the body's initial pose
  Interpolation interpolation = Interpolation::smooth;
  bool loop = false;  ///< repeat with the period keys.back().time - keys.front().time; else hold the ends
  Vec3 spin = Vec3::Zero();  ///< extra rotation about the body's origin, body axes [rad/s]

  bool moves() const { return !keys.empty() || !spin.isZero(); }
  /// Pose and exact derivative at time t; `rest` is the pose where there are no keys.
  Motion at(Real t, const Pose& rest) const;
};

}  // namespace offstage::sim
