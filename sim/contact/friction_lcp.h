#pragma once
/// Solves contacts with Coulomb friction by pivoting on the dense matrix of a small cluster (physics N10). It
/// is used for collisions of up to about twenty contacts.

#include <span>

#include "sim/contact/contact_problem.h"

namespace offstage::sim {

/// Solves the problem of contact_problem.h from zero impulses; the contacts' guesses are ignored. It sets the
/// contacts' impulses and adds their effect to the bodies' velocities. Isotropic contacts have the round
/// cone: between successive pivoting solutions their tangents are aligned with the direction of sliding, and
/// Newton's method on the cone refines the result. If the residual exceeds rounding, projected Gauss-Seidel
/// continues from the result.
ContactWork solve_by_pivoting(std::span<ContactBody> bodies, std::span<Contact> contacts);

}  // namespace offstage::sim
