#include "sim/contact_graph.h"

#include <algorithm>

namespace offstage::sim {
namespace {

/// Disjoint sets of numbers, each named by its least.
class Sets {
 public:
  explicit Sets(std::size_t size) : parent_(size) {
    for (uint32_t i = 0; i < size; ++i) parent_[i] = i;
  }
  uint32_t find(uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(uint32_t i, uint32_t j) {
    i = find(i);
    j = find(j);
    parent_[std::max(i, j)] = std::min(i, j);
  }

 private:
  std::vector<uint32_t> parent_;
};

}  // namespace

void ContactGraph::forget(uint32_t slot) {
  std::erase_if(entries_, [slot](const Entry& e) { return e.low == slot || e.high == slot; });
}

std::vector<Island> find_islands(std::span<Body* const> bodies, std::span<ContactPair* const> pairs,
                                 std::span<const std::pair<Body*, Body*>> springs) {
  for (uint32_t i = 0; i < bodies.size(); ++i) bodies[i]->row = i;
  Sets sets(bodies.size());
  for (const ContactPair* pair : pairs)
    if (!pair->manifolds().empty() && pair->a().is_awake() && pair->b().is_awake())
      sets.join(pair->a().row, pair->b().row);
  for (const auto& [a, b] : springs)
    if (a->is_awake() && b->is_awake()) sets.join(a->row, b->row);

  std::vector<Island> islands;
  for (uint32_t i = 0; i < bodies.size(); ++i) {
    const uint32_t root = sets.find(i);
    if (root == i) {
      bodies[i]->island = static_cast<uint32_t>(islands.size());
      islands.emplace_back();
    } else {
      bodies[i]->island = bodies[root]->island;
    }
    islands[bodies[i]->island].bodies.push_back(bodies[i]);
  }
  for (ContactPair* pair : pairs) {
    if (pair->manifolds().empty()) continue;
    const Body& moved = pair->a().is_awake() ? pair->a() : pair->b();
    if (moved.is_awake()) islands[moved.island].pairs.push_back(pair);
  }
  return islands;
}

}  // namespace offstage::sim
