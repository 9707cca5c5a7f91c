#pragma once
/// Contacts with Coulomb friction by pivoting on the dense matrix of a small cluster (physics N10): it
/// resolves collisions of up to some twenty contacts.

#include <span>

#include "sim/contact/contact_problem.h"

namespace offstage::sim {

/// Solves the problem of contact_problem.h from zero impulses, whatever the contacts hold: sets the contacts'
/// impulses and adds to the bodies' velocities. Isotropic contacts end on the round cone: their tangents are
/// turned along the sliding between the solutions by pivoting, and Newton's method on the cone itself does
/// the rest. If that leaves more than rounding, projected Gauss-Seidel goes on from there.
ContactWork solve_by_pivoting(std::span<ContactBody> bodies, std::span<Contact> contacts);

}  // namespace offstage::sim
