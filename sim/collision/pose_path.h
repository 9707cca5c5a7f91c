#pragma once
/// Path of a solid from one pose to another during a step. The origin of its frame moves on a straight line
/// at constant speed. Its orientation follows the shortest arc, by normalized linear interpolation of the two
/// quaternions: a rotation about a fixed axis that needs no trigonometry. The rate of rotation is constant
/// within 6 % for a quarter turn, and within angle^2 / 48 for small angles. Time is the fraction of the step,
/// from 0 to 1, so velocities are per step.

#include "sim/core/types.h"

namespace offstage::sim {

class PosePath {
 public:
  PosePath(const Pose& start, const Pose& end);
  /// A path that stays at a pose.
  explicit PosePath(const Pose& pose) : PosePath(pose, pose) {}

  Pose at(Real fraction) const;
  const Pose& start() const { return start_; }
  const Pose& end() const { return end_; }

  /// Velocity of the origin, world [m per step].
  const Vec3& velocity() const { return velocity_; }
  /// Angular velocity, world [rad per step].
  Vec3 angular_velocity(Real fraction) const;
  /// turns(): whether the orientations differ. turn(): the angle between them, 0 to pi [rad].
  bool turns() const { return sine_ > 0; }
  Real turn() const;
  /// Upper bound of the acceleration of all points within `reach` of the origin [m per step^2].
  Real max_acceleration(Real reach) const { return reach * max_acceleration_; }

 private:
  Pose start_, end_;
  Vec3 velocity_;
  Vec3 axis_;              // unit, world
  Real sine_, cosine_;     // sine and cosine of half the angle of rotation
  Real max_acceleration_;  // acceleration of a point at distance 1
};

}  // namespace offstage::sim
