#pragma once
/// Finds the contacts with other bodies that hold the bodies near cloth and under particles while these push
/// them (resting_contacts.h).

#include <map>
#include <span>
#include <vector>

#include "sim/cloth/cloth_bodies.h"
#include "sim/contact/contact_pair.h"
#include "sim/world/world_state.h"

namespace offstage::sim {

/// Finds the contacts of some awake dynamic bodies with others at the end of a sub-step of length h [s]. The
/// keys of `contacts` are the slots of these bodies. `pairs`: all pairs of this sub-step, after the contact
/// solver.
void find_resting_contacts(std::span<ContactPair* const> pairs, Real h,
                           std::map<uint32_t, std::vector<RestingContact>>& contacts);
/// Gives the awake dynamic bodies in `near` their contacts at the end of a sub-step of length h [s]. `pairs`:
/// all pairs of this sub-step, after the contact solver.
void set_resting_contacts(const WorldState& world, std::span<ContactPair* const> pairs, Real h,
                          std::span<ClothBody> near);

}  // namespace offstage::sim
