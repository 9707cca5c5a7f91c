#pragma once
/// Finds the contacts with other bodies that hold the bodies near cloth while cloth pushes them
/// (resting_contacts.h).

#include <span>

#include "sim/cloth/cloth_bodies.h"
#include "sim/contact/contact_pair.h"
#include "sim/world/world_state.h"

namespace offstage::sim {

/// Gives the awake dynamic bodies in `near` their contacts at the end of a sub-step of length h [s]. `pairs`:
/// all pairs of this sub-step, after the contact solver.
void set_resting_contacts(const WorldState& world, std::span<ContactPair* const> pairs, Real h,
                          std::span<ClothBody> near);

}  // namespace offstage::sim
