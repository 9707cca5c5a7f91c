#pragma once
/// What springs, joints and forces between particles join (physics E7): dynamic bodies and particle systems
/// that are connected through them, however far, form a component. A particle system counts as one object.

#include <span>
#include <utility>
#include <vector>

#include "sim/world/world_impl.h"

namespace offstage::sim {

class CouplingGraph {
 public:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  explicit CouplingGraph(const WorldState& world);

  /// Numbers of components are below this.
  std::size_t size() const { return objects_.size(); }
  /// A number that connected objects share; kNone for what nothing joins.
  std::size_t component(const Body& body) const { return find(&body); }
  std::size_t component(const ParticleSystem& system) const { return find(&system); }
  /// That of its ends; kNone if neither can be moved.
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
  std::vector<std::size_t> parent_;   // a forest, of components
};

/// The bodies given and all that are connected to them, in the world's order.
std::vector<Body*> connected(WorldState& world, std::span<Body* const> bodies);

}  // namespace offstage::sim
