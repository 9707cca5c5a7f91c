#pragma once
/// Gauss-Seidel over contacts and joints: the fall-back for collisions of jointed bodies that the proximal
/// method does not solve.

#include <span>

#include "sim/articulation/joint_problem.h"
#include "sim/contact/contact_problem.h"

namespace offstage::sim {

/// Solves contacts and joints by Gauss-Seidel from zero impulses. A sweep solves the joints (each as a
/// block), the rows with bounds and the contacts one after the other. Sweeps end when no velocity changes by
/// more than `tolerance` [m/s], or after `max_sweeps`. If all targets are zero and no link is driven, each
/// step dissipates kinetic energy, so the result is safe after any number of sweeps. Returns the number of
/// sweeps.
uint32_t jointed_gauss_seidel(std::span<ContactBody> bodies, std::span<Contact> contacts,
                              const JointProblem& joints, uint32_t max_sweeps, Real tolerance);

}  // namespace offstage::sim
