#pragma once
/// Bodies as cloths meet them in a sub-step of the world: on the ways that the world gave them, moved besides
/// by what cloth does to them. That is returned as reactions and counts for the world from its next sub-step
/// on (as for particles, P8).

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "sim/collision/obstacles.h"

namespace offstage::sim {

class ClothBody {
 public:
  /// `velocity` and `angular_velocity` are the body's at the end of the sub-step of length h [s];
  /// `surface_velocity` is against the body, in its frame.
  ClothBody(const Obstacle& way, Real h, const Vec3& velocity, const Vec3& angular_velocity,
            const Vec3& surface_velocity);

  /// A sub-step of cloth begins: from and to which fraction of the world's, dt [s] long.
  void begin(Real from, Real to, Real dt);
  Real duration() const { return dt_; }         ///< of that sub-step [s]
  const Pose& start() const { return start_; }  ///< of that sub-step
  const Pose& end() const { return end_; }
  const Solid& solid() const { return way_.solid; }
  const Obstacle& way() const { return way_; }
  bool is_dynamic() const { return way_.is_dynamic(); }
  /// [kg]; infinite of what nothing moves.
  Real mass() const { return 1 / way_.inverse_mass; }
  const Vec3& centre() const { return centre_; }  ///< of mass, at the end of the cloth's sub-step

  /// How far its surface moves in the sub-step of cloth, where the point `p` (world) is at its end.
  Vec3 surface_motion(const Vec3& p) const;
  /// Velocity of its material point at `p` at the end of the world's sub-step, as cloth has changed it.
  Vec3 velocity(const Vec3& p) const { return velocity_ + angular_velocity_.cross(p - centre_); }
  /// Velocity that a unit impulse along n (unit) at p gives to the point there, along n [1/kg].
  Real mobility(const Vec3& p, const Vec3& n) const;
  /// An impulse at a point [N s].
  void push(const Vec3& impulse, const Vec3& p);
  /// The same by what hangs on a pin, which moves the body in this sub-step of cloth already: by `share` of
  /// what the gain of velocity does in one. A body that followed later than it was pulled would gain energy.
  void pull(const Vec3& impulse, const Vec3& p, Real share);

  /// What hangs on a pin pulls at a body that it does not move: one that is asleep.
  void load(const Vec3& impulse, const Vec3& p);
  /// Impulse and angular impulse of all that, in this sub-step of the world; empty: no pin.
  const std::optional<Reaction>& pin_load() const { return pin_load_; }

  const Reaction& reaction() const { return reaction_; }
  /// A point of cloth touches it, which moves at this speed against it [m/s].
  void touch(Real speed) {
    touched = true;
    touching_speed = std::max(touching_speed, speed);
  }

  bool touched = false;     ///< by cloth, in this sub-step of the world
  Real touching_speed = 0;  ///< greatest [m/s]
  bool pinches = false;     ///< cloth against another body, in this sub-step of the world
  bool collides = true;     ///< else it only holds pins

 private:
  Obstacle way_;
  Real h_;
  Vec3 velocity_, angular_velocity_;  // of the centre of mass, at the end
  Vec3 surface_velocity_;
  Vec3 gained_ = Vec3::Zero(), gained_spin_ = Vec3::Zero();  // of velocity
  Vec3 shift_ = Vec3::Zero(), turn_ = Vec3::Zero();          // by that, of the centre
  Vec3 centre_ = Vec3::Zero();                               // of mass, at the end of cloth's sub-step
  Pose start_, end_;                                         // of that sub-step
  Real dt_ = 0, to_ = 0;                                     // of cloth's sub-step
  Reaction reaction_;
  std::optional<Reaction> pin_load_;
};

}  // namespace offstage::sim
