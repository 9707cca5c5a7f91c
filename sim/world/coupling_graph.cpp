#include "sim/world/coupling_graph.h"

#include <algorithm>
#include <numeric>

namespace offstage::sim {

CouplingGraph::CouplingGraph(const WorldState& world) : world_(world) {
  for_each_link([&](const void* a, const void* b) {
    for (const void* o : {a, b})
      if (o) objects_.push_back(o);
  });
  std::sort(objects_.begin(), objects_.end());
  objects_.erase(std::unique(objects_.begin(), objects_.end()), objects_.end());
  parent_.resize(objects_.size());
  std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  for_each_link([&](const void* object_a, const void* object_b) {
    const std::size_t a = find(object_a), b = find(object_b);
    if (a != kNone && b != kNone) parent_[std::max(a, b)] = std::min(a, b);
  });
  // A parent comes before its children, so after one pass all parents are roots.
  for (std::size_t& parent : parent_) parent = parent_[parent];
}

/// Calls f(a, b) for each direct connection of two objects. a or b may be null, and both may be the same
/// object.
template <class F>
void CouplingGraph::for_each_link(F&& f) const {
  world_.springs.for_each([&](SpringHandle, const Spring& spring) {
    if (world_.acts(spring)) f(object(spring.def.a), object(spring.def.b));
  });
  for (const auto& articulation : world_.articulations)
    for (const Body* body : articulation->bodies()) f(articulation->bodies().front(), body);
  world_.force_defs.for_each([&](ForceHandle, const ForceDef& force) {
    if (!force.is_pairwise()) return;
    const void* first = nullptr;
    for (ParticleSystemHandle handle : force.systems)
      if (const void* system = world_.systems.find(handle)) {
        if (!first) first = system;
        f(first, system);
      }
  });
}

std::size_t CouplingGraph::component(const Spring& spring) const {
  const std::size_t a = find(object(spring.def.a));
  return a != kNone ? a : find(object(spring.def.b));
}

std::size_t CouplingGraph::component(const Articulation& articulation) const {
  return find(articulation.bodies().front());
}

/// Returns the object at an end of a spring; null if the end cannot move.
const void* CouplingGraph::object(const Attachment& a) const {
  if (const auto* point = std::get_if<BodyPoint>(&a)) {
    const Body* body = world_.bodies[point->body].get();
    return body->is_dynamic() ? body : nullptr;
  }
  if (const auto* point = std::get_if<ParticlePoint>(&a)) return &world_.systems[point->system];
  return nullptr;
}

std::size_t CouplingGraph::find(const void* object) const {
  const auto at = std::lower_bound(objects_.begin(), objects_.end(), object);
  if (at == objects_.end() || *at != object) return kNone;
  return root(static_cast<std::size_t>(at - objects_.begin()));
}

std::size_t CouplingGraph::root(std::size_t i) const {
  while (parent_[i] != i) i = parent_[i];
  return i;
}

std::vector<Body*> connected(WorldState& world, std::span<Body* const> bodies) {
  const CouplingGraph graph(world);
  std::vector<const Body*> single;
  std::vector<std::size_t> components;
  for (const Body* body : bodies) {
    const std::size_t c = graph.component(*body);
    if (c == CouplingGraph::kNone)
      single.push_back(body);
    else
      components.push_back(c);
  }
  std::sort(single.begin(), single.end());
  std::sort(components.begin(), components.end());
  std::vector<Body*> all;
  world.bodies.for_each([&](BodyHandle, const std::unique_ptr<Body>& body) {
    const std::size_t c = graph.component(*body);
    if (c == CouplingGraph::kNone ? std::binary_search(single.begin(), single.end(), body.get())
                                  : std::binary_search(components.begin(), components.end(), c))
      all.push_back(body.get());
  });
  return all;
}

}  // namespace offstage::sim
