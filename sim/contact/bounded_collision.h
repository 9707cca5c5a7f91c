#pragma once
/// Collision impulses of clusters with a bounded amount of work, for the fast solver and for large heaps.

#include "sim/contact/collision.h"

namespace offstage::sim {

/// Clusters without joints and with at most this many contacts are solved by pivoting.
inline constexpr std::size_t kFewContacts = 8;

/// Resolves collisions as collide() does, with at most about ten thousand operations. It never adds kinetic
/// energy. Afterwards some contacts of a large cluster may still approach. `budget` [ns] limits the cost of a
/// more accurate solution of clusters of at most 100 contacts, and is reduced by this cost. The impulses of
/// contacts with Contact::is_guessed are initial guesses, whose effect is not yet included in the velocities.
ContactWork collide_bounded(std::span<ContactBody> bodies, std::span<Contact> contacts,
                            std::span<const Real> restitution, ImpactLaw law, const JointProblem& joints,
                            Real& budget);

}  // namespace offstage::sim
