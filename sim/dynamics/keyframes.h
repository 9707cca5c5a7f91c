#pragma once
/// Keyframed motion of kinematic bodies (physics E8, N6): positions by one of the interpolations,
/// orientations by slerp, and the velocities that belong to them.

#include <optional>
#include <vector>

#include "sim/core/types.h"
#include "sim/dynamics/interpolation.h"

namespace offstage::sim {

struct Keyframe {
  Real time = 0;  ///< [s]
  Pose pose;
  std::optional<Interpolation> interpolation = {};  ///< to the next key; default: the track's
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
  Interpolation interpolation = Interpolation::monotone;  ///< of positions; orientations turn at a constant
                                                          ///< rate between two keys, or step
  bool loop = false;  ///< repeat with the period keys.back().time - keys.front().time; else hold the ends
  Vec3 spin = Vec3::Zero();  ///< extra rotation about the body's origin, body axes [rad/s]

  bool moves() const { return !keys.empty() || !spin.isZero(); }
  /// Pose and exact derivative at time t; `rest` is the pose where there are no keys.
  Motion at(Real t, const Pose& rest) const;
  /// Whether the pose jumps after `from` and not after `to`, by a step or at the end of a loop that does not
  /// close.
  bool jumps(Real from, Real to) const;
};

}  // namespace offstage::sim
