#pragma once
/// Keyframed motion of kinematic bodies (physics E8, N6): positions and orientations interpolated between
/// keys (interpolation.h), with the matching velocities.

#include <optional>
#include <vector>

#include "sim/core/types.h"
#include "sim/dynamics/interpolation.h"

namespace offstage::sim {

struct Keyframe {
  Real time = 0;  ///< [s]
  Pose pose;
  /// Interpolation to the next key; default: the interpolation of the track.
  std::optional<Interpolation> interpolation = {};
};

/// A pose with its velocities.
struct Motion {
  Pose pose;
  Vec3 velocity = Vec3::Zero();          ///< velocity of the origin, world [m/s]
  Vec3 angular_velocity = Vec3::Zero();  ///< world [rad/s]
};

/// Key poses over time, plus an optional constant spin (for wheels and gears, which would need many keys).
struct KeyframeTrack {
  std::vector<Keyframe> keys;  ///< strictly increasing times; empty: the body stays at its initial pose
  /// Default interpolation of the keys. Between two keys, orientations follow the shortest arc if the
  /// neighbouring keys turn about the same axis.
  Interpolation interpolation = Interpolation::monotone;
  /// Whether the keys repeat with the period keys.back().time - keys.front().time. Otherwise the pose is
  /// constant before the first and after the last key.
  bool loop = false;
  Vec3 spin = Vec3::Zero();  ///< additional rotation about the body's origin, body axes [rad/s]

  bool moves() const { return !keys.empty() || !spin.isZero(); }
  /// Whether the pose may change at a time after t.
  bool moves_after(Real t) const {
    return (!keys.empty() && (loop || keys.back().time > t)) || !spin.isZero();
  }
  /// Returns the pose and its exact derivative at time t; `rest` is the pose without keys.
  Motion at(Real t, const Pose& rest) const;
  /// Whether the pose jumps at a time in (from, to], by a step or at the end of a loop that is not closed.
  bool jumps(Real from, Real to) const;
};

}  // namespace offstage::sim
