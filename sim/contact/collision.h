#pragma once
/// Collisions of bodies: the impulse of one contact in closed form, and the impulses of a cluster of
/// simultaneous contacts (physics R6, R7, P5, P6; Coutinho, 4.6 to 4.9). Friction opposes the sliding that
/// remains after the impact, and a collision never adds kinetic energy.

#include <cstdint>
#include <span>

#include "sim/articulation/joint_problem.h"
#include "sim/contact/contact_problem.h"

namespace offstage::sim {

/// Order of the impulses in a cluster.
enum class ImpactLaw : uint8_t {
  simultaneous,  ///< solves all impulses together: P_n >= 0 complementary to u_n >= -e u_n(before)
  /// Solves one contact after the other, the fastest approach first. Contacts that approach equally fast are
  /// solved together. Impulses propagate as in Newton's cradle.
  sequential
};

/// Returns the impulse on body a in the contact's frame (n, t, k) [N s]. `K` is the mobility [1/kg], and `u`
/// the relative velocity of the points [m/s]. The impulse is zero if the points do not approach. Equal
/// coefficients give the round friction cone, |P_tk| = mu P_n against the sliding; otherwise each axis sticks
/// or slides separately.
Vec3 collision_impulse(const Mat3& K, const Vec3& u, Real restitution, Real friction_t, Real friction_k);

/// Resolves a cluster: changes the bodies' velocities, and sets the contacts' targets and total impulses.
/// `restitution`: the coefficient of each contact, in [0, 1]. Contacts that do not approach do not bounce but
/// may have impulses. Joint constraints are part of the same system of equations (physics A3).
ContactWork collide(std::span<ContactBody> bodies, std::span<Contact> contacts,
                    std::span<const Real> restitution, ImpactLaw law, const JointProblem& joints = {});

}  // namespace offstage::sim
