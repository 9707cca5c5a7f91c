#pragma once
/// The islands of a world in a sub-step (physics E6, E7).

#include <span>
#include <vector>

#include "sim/contact/contact_graph.h"
#include "sim/world/world_state.h"

namespace offstage::sim {

class CoupledSystem;

/// Groups the awake bodies into `islands` by joints, springs and those contacts for which `connect` returns
/// true. `motion` is the system that has moved the bodies.
void find_moving_islands(const WorldState& world, std::span<Body* const> awake,
                         std::span<ContactPair* const> pairs, bool (*connect)(const ContactPair&),
                         CoupledSystem& motion, std::vector<Island>& islands);

}  // namespace offstage::sim
