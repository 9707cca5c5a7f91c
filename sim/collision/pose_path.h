#pragma once
/// How a solid gets from one pose to another during a step: its frame's origin goes straight and at constant
/// speed, and its orientation along the shortest arc, as the normalised linear interpolation of the two
/// quaternions. That turns about a fixed axis and needs no trigonometry; its rate is within 6 % of constant
/// for a quarter turn and 1 + angle^2 / 48 for small ones. Time is the share of the step, from 0 to 1, so
/// velocities are per step.

#include "sim/core/types.h"

namespace offstage::sim {

class PosePath {
 public:
  PosePath(const Pose& start, const Pose& end);
  /// Stays where it is.
  explicit PosePath(const Pose& pose) : PosePath(pose, pose) {}

  Pose at(Real share) const;
  const Pose& start() const { return start_; }
  const Pose& end() const { return end_; }

  /// Velocity of the origin, world [m per step].
  const Vec3& velocity() const { return velocity_; }
  /// World [rad per step].
  Vec3 angular_velocity(Real share) const;
  /// Whether the orientations differ, and the angle between them, 0 to pi [rad].
  bool turns() const { return sine_ > 0; }
  Real turn() const;
  /// No point within `reach` of the origin has an acceleration beyond this at any time [m per step^2].
  Real max_acceleration(Real reach) const { return reach * max_acceleration_; }

 private:
  Pose start_, end_;
  Vec3 velocity_;
  Vec3 axis_;              // unit, world
  Real sine_, cosine_;     // of half the angle of the turn
  Real max_acceleration_;  // of a point at distance 1
};

}  // namespace offstage::sim
