#pragma once
/// Energy and momentum of bodies connected by joints, to check and correct their motion (physics A1, A5).

#include <span>

#include "sim/articulation/articulation.h"

namespace offstage::sim {

/// Motion of a single rigid body with the same mass distribution, momentum and angular momentum as several
/// bodies.
struct CommonMotion {
  Vec3 centre = Vec3::Zero(), velocity = Vec3::Zero(), angular_velocity = Vec3::Zero();
  Vec3 angular_momentum = Vec3::Zero();  ///< angular momentum about the centre [kg m^2/s]
  Mat3 inverse_inertia = Mat3::Zero();   ///< inverse inertia about the centre, world axes [1/(kg m^2)]

  Vec3 velocity_at(const Vec3& place) const { return velocity + angular_velocity.cross(place - centre); }
};
CommonMotion common_motion(std::span<Body* const> bodies);

/// Returns the greatest constraint error of an articulation's joints at a time [m], [rad].
Real joint_gap(const Articulation& articulation, Real time);
/// Returns the elastic energy of a joint at a time [J]: the energy of its stiffness, and of a position motor
/// with a stiffness, which acts as a spring with limited effort.
Real spring_energy(const Joint& joint, Real time);
/// Whether a joint connects the articulation to the world or to a static or kinematic body.
bool is_held(const Articulation& articulation);
/// Whether a joint connects the articulation to a kinematic body, which may do work.
bool has_kinematic_end(const Articulation& articulation);

/// Returns the kinetic energy of the links relative to their common motion [J]. If the articulation
/// is_held(), returns the whole kinetic energy.
Real internal_energy(const Articulation& articulation);
/// Multiplies the velocities relative to the common motion by `fraction`, from 0 to 1. The velocities still
/// satisfy the constraints. If the articulation is not held, momentum and angular momentum are conserved.
void slow_down(const Articulation& articulation, Real fraction);
/// Rotates the velocities of all bodies together to restore the angular momentum of `before`, after
/// corrections have displaced the bodies.
void keep_angular_momentum(std::span<Body* const> bodies, const CommonMotion& before);

}  // namespace offstage::sim
