#pragma once
/// Connections by springs, joints and forces between particles (physics E7). Dynamic bodies and particle
/// systems that are connected, directly or through others, form a component. A particle system counts as one
/// object.

#include <span>
#include <utility>
#include <vector>

#include "sim/world/world_state.h"

namespace offstage::sim {

class CouplingGraph {
 public:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  explicit CouplingGraph(const WorldState& world);

  /// Upper bound of the component indices: every index is smaller.
  std::size_t size() const { return objects_.size(); }
  /// Index of the component that contains the object; kNone for an object without connections.
  std::size_t component(const Body& body) const { return find(&body); }
  std::size_t component(const ParticleSystem& system) const { return find(&system); }
  /// Index of the component that contains the ends of the spring; kNone if neither end can move.
  std::size_t component(const Spring& spring) const;
  std::size_t component(const Articulation& articulation) const;

 private:
  const void* object(const Attachment& a) const;
  template <class F>
  void for_each_link(F&& f) const;
  std::size_t find(const void* object) const;
  std::size_t root(std::size_t i) const;

  const WorldState& world_;
  std::vector<const void*> objects_;  // by address
  std::vector<std::size_t> parent_;   // disjoint-set forest of the components
};

/// Returns the given bodies and all bodies that are connected to them, in the world's order.
std::vector<Body*> connected(WorldState& world, std::span<Body* const> bodies);

}  // namespace offstage::sim
