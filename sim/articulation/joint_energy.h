#pragma once
/// Energy and momentum of bodies that joints hold together: what guards their motion (physics A1, A5).

#include <span>

#include "sim/articulation/articulation.h"

namespace offstage::sim {

/// Motion of bodies as if they were one rigid body of the same momenta.
struct CommonMotion {
  Vec3 centre = Vec3::Zero(), velocity = Vec3::Zero(), angular_velocity = Vec3::Zero();
  Vec3 angular_momentum = Vec3::Zero();  ///< about the centre [kg m^2/s]
  Mat3 inverse_inertia = Mat3::Zero();   ///< about the centre, world axes [1/(kg m^2)]

  Vec3 velocity_at(const Vec3& place) const { return velocity + angular_velocity.cross(place - centre); }
};
CommonMotion common_motion(std::span<Body* const> bodies);

/// How far an articulation's bodies are from what its joints allow at a time: the greatest error of a
/// constraint [m], [rad].
Real joint_gap(const Articulation& articulation, Real time);
/// Whether a joint connects it to the world or to a body that no force moves.
bool is_held(const Articulation& articulation);
/// Whether a joint connects it to a body that keys move, which may do work.
bool has_kinematic_end(const Articulation& articulation);

/// Kinetic energy of the links relative to their common motion; of an articulation that is held, all of it
/// [J].
Real internal_energy(const Articulation& articulation);
/// Multiplies the velocities relative to the common motion by a share, 0 to 1. Joints allow the result as
/// they allow the velocities before, and an articulation that is not held keeps its momenta.
void slow_down(const Articulation& articulation, Real share);
/// Turns all bodies together so that their angular momentum becomes that of `before` again, after shifts of
/// their masses.
void keep_angular_momentum(std::span<Body* const> bodies, const CommonMotion& before);

}  // namespace offstage::sim
