#pragma once
/// Contact forces of an island by linear complementarity (physics R8, R9, N9, N10): Dantzig's method without
/// friction, Baraff's method with it. As in the book, friction has a separate limit along each tangent of the
/// contact frame: a pyramid replaces the cone. Joints are eliminated: their constraints reduce the mobility
/// of the bodies, and their limits, motors and friction are additional rows.

#include <span>

#include "sim/articulation/joint_problem.h"
#include "sim/contact/contact_problem.h"

namespace offstage::sim {

/// Greatest number of contacts, and greatest number of joint constraints, that are solved by pivoting. The
/// work of pivoting grows with the third power of these numbers.
inline constexpr std::size_t kMostLcpContacts = 64, kMostLcpConstraints = 240;

/// Solves the problem of contact_problem.h from zero impulses, with the limits |p_t| <= mu_t p_n and |p_k| <=
/// mu_k p_n in place of the cone. On success it sets the impulses of contacts and joints and adds their
/// effect to the bodies' velocities. Otherwise it returns false and changes nothing. It fails if there are
/// too many contacts or constraints, if a contact has rolling or spinning friction, or if pivoting fails or
/// leaves a residual. The work is always added to `work`; a failure is counted as a fall-back.
bool solve_by_lcp(std::span<ContactBody> bodies, std::span<Contact> contacts, const JointProblem& joints,
                  ContactWork& work);

}  // namespace offstage::sim
