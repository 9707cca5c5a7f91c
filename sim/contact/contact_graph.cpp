#include "sim/contact/contact_graph.h"

#include <algorithm>
#include <limits>

#include "sim/core/disjoint_sets.h"
#include "sim/core/parallel_loop.h"

namespace offstage::sim {
namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

/// The rows of the two bodies of a pair in the list of awake bodies; kNone for a body that is not in the
/// list.
struct Link {
  uint32_t a = kNone, b = kNone;
  bool connects = true;

  bool moves() const { return a != kNone || b != kNone; }
};

}  // namespace

void ContactGraph::forget(uint32_t slot) {
  std::erase_if(entries_, [slot](const Entry& e) { return e.low == slot || e.high == slot; });
}

bool may_touch(const ContactPair& pair) {
  return !pair.manifolds().empty();
}

bool touch_or_push(const ContactPair& pair) {
  if (pair.touching() > 0) return true;
  if (pair.needs_toi) return false;  // such pairs are left out of the solution
  for (const PlacedManifold& m : pair.manifolds())
    for (uint32_t k = 0; k < m.manifold.count; ++k)
      if (m.forces[k].now != Vec3::Zero()) return true;
  return false;
}

void find_islands(std::span<Body* const> bodies, std::span<ContactPair* const> pairs,
                  bool (*connect)(const ContactPair&), std::span<const std::pair<Body*, Body*>> springs,
                  std::vector<Island>& islands) {
  // Bodies and pairs are scattered in memory, so their data are gathered in parallel. The sequential part
  // then uses only their numbers.
  for_each_index(bodies.size(), [&](std::size_t i) { bodies[i]->row = static_cast<uint32_t>(i); });
  const auto link = [](const Body& a, const Body& b) {
    return Link{a.is_awake() ? a.row : kNone, b.is_awake() ? b.row : kNone, true};
  };
  std::vector<Link> links(pairs.size());
  for_each_index(pairs.size(), [&](std::size_t i) {
    if (pairs[i]->manifolds().empty()) return;
    links[i] = link(pairs[i]->a(), pairs[i]->b());
    links[i].connects = connect(*pairs[i]);
  });
  DisjointSets sets(bodies.size());
  const auto join = [&](const Link& l) {
    if (l.connects && l.a != kNone && l.b != kNone) sets.join(l.a, l.b);
  };
  for (const Link& l : links) join(l);
  for (const auto& [a, b] : springs) join(link(*a, *b));

  struct Size {
    uint32_t bodies = 0, pairs = 0;
  };
  std::vector<Size> sizes;
  std::vector<uint32_t> number(bodies.size());
  for (uint32_t i = 0; i < bodies.size(); ++i) {
    const uint32_t root = sets.find(i);
    if (root == i) sizes.emplace_back();
    number[i] = root == i ? static_cast<uint32_t>(sizes.size() - 1) : number[root];
    ++sizes[number[i]].bodies;
  }
  const auto island_of = [&](const Link& l) { return number[l.a != kNone ? l.a : l.b]; };
  const auto is_within_one = [&](const Link& l) {
    return l.moves() && (l.a == kNone || l.b == kNone || number[l.a] == number[l.b]);
  };
  for (const Link& l : links)
    if (is_within_one(l)) ++sizes[island_of(l)].pairs;

  islands.resize(sizes.size());
  for (std::size_t i = 0; i < islands.size(); ++i) {
    Island& island = islands[i];
    island.bodies.clear();
    island.bodies.reserve(sizes[i].bodies);
    island.pairs.clear();
    island.pairs.reserve(sizes[i].pairs);
    island.articulations.clear();
    island.motion = nullptr;
    island.from = 0;
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) islands[number[i]].bodies.push_back(bodies[i]);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (is_within_one(links[i])) islands[island_of(links[i])].pairs.push_back(pairs[i]);
  for_each_index(bodies.size(), [&](std::size_t i) { bodies[i]->island = number[i]; });
}

}  // namespace offstage::sim
