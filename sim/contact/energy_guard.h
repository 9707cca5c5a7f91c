#pragma once
/// Limit on the energy that an approximate solution of contacts may add.

#include <span>

#include "sim/contact/contact_graph.h"
#include "sim/contact/relaxation.h"

namespace offstage::sim {

/// Whether a kinematic body, a conveyor or a motor may do work on an island.
bool can_do_work(const Island& island);

/// Kinetic energy of an island's bodies [J].
Real kinetic_energy(const Island& island);

/// Returns the factor for an island's contact and joint impulses with which they add no kinetic energy to the
/// island's free motion (the states Body::rigid). It is 1 unless the impulses add more than a fiftieth of the
/// energy of that motion. Contacts and joints dissipate energy, except for the error of their velocity terms
/// over a step, which is unbounded for a thin body that turns far in a step. Since all impulses are scaled by
/// one factor, the momenta are conserved. The factor is 1 for an island driven by a kinematic body, a
/// conveyor or a motor.
Real kept_fraction(const Island& island, std::span<const RelaxedBody> relaxed);

}  // namespace offstage::sim
