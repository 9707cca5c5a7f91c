#include "sim/world/moving_islands.h"

#include "sim/world/coupling_graph.h"

namespace offstage::sim {

void find_moving_islands(const WorldState& world, std::span<Body* const> awake,
                         std::span<ContactPair* const> pairs, bool (*connect)(const ContactPair&),
                         CoupledSystem& motion, std::vector<Island>& islands) {
  std::vector<std::pair<Body*, Body*>> joined;
  if (!world.springs.empty() || !world.articulations.empty()) {
    const CouplingGraph connections(world);
    std::vector<Body*> first(connections.size(), nullptr);
    for (Body* body : awake) {
      const std::size_t c = connections.component(*body);
      if (c == CouplingGraph::kNone) continue;
      if (first[c]) joined.emplace_back(first[c], body);
      first[c] = body;
    }
  }
  find_islands(awake, pairs, connect, joined, islands);
  for (Island& island : islands) island.motion = &motion;
  for (const auto& articulation : world.articulations)
    if (const Body& first = *articulation->bodies().front(); first.is_awake())
      islands[first.island].articulations.push_back(articulation.get());
}

}  // namespace offstage::sim
