#pragma once
/// Contact forces of an island by linear complementarity (physics R8, R9, N9, N10): Dantzig's method without
/// friction, Baraff's with it. Friction has a separate limit along each of the contact frame's tangents, a
/// pyramid in place of the cone, as in the book. Joints are eliminated: their constraints reduce the mobility
/// of the bodies, and their limits, motors and friction are further rows.

#include <span>

#include "sim/articulation/joint_problem.h"
#include "sim/contact/contact_problem.h"

namespace offstage::sim {

/// Greatest numbers of contacts, and of constraints of joints, that are solved by pivoting. Its work grows
/// with their third power.
inline constexpr std::size_t kMostLcpContacts = 64, kMostLcpConstraints = 240;

/// Solves the problem of contact_problem.h from zero impulses, with |p_t| <= mu_t p_n and |p_k| <= mu_k p_n
/// in place of the cone. On success it sets the impulses of contacts and joints and adds their effect to the
/// bodies' velocities. Otherwise it returns false and changes nothing: for more contacts or constraints than
/// the limits, contacts with rolling or spinning friction, and where pivoting fails or leaves a residual. In
/// both cases it adds its work to `work`; a failure is a fall-back.
bool solve_by_lcp(std::span<ContactBody> bodies, std::span<Contact> contacts, const JointProblem& joints,
                  ContactWork& work);

}  // namespace offstage::sim
