#pragma once
/// The triangles of cloth near bodies that may press the cloth against each other (physics F7).

#include <span>
#include <vector>

#include "sim/contact/contact_pair.h"
#include "sim/world/world_state.h"

namespace offstage::sim {

class ClothNearBodies {
 public:
  explicit ClothNearBodies(const WorldState& world) : world_(world) {}

  /// Begins a sub-step of length h [s].
  void begin(Real h);
  /// Whether there is any cloth that collides with bodies.
  bool any() const { return thickest_ > 0; }
  /// Returns the distance by which the box of a body's path grows, because cloth may keep other bodies away
  /// from it [m].
  Real room(const Aabb& box) const { return is_near(box) ? room() : 0; }
  /// Greatest distance at which cloth between two bodies is searched [m].
  Real room() const;
  /// Finds the triangles near those awake bodies that have a pair.
  void find(std::span<ContactPair* const> pairs);
  /// Returns the triangles that may be between the bodies of a pair.
  std::span<const LayerTriangle> between(const ContactPair& pair) const;

 private:
  bool is_near(const Aabb& box) const;
  void collect(const Aabb& box, std::vector<LayerTriangle>& found) const;

  const WorldState& world_;
  struct Near {
    uint32_t slot;
    const Cloth* cloth;
    Aabb box;  // of its motion in the sub-step, grown by room()
  };
  std::vector<Near> cloths_;                      // that collide with bodies
  Real thickest_ = 0;                             // greatest thickness of these cloths [m]; 0: there is none
  std::vector<std::vector<LayerTriangle>> near_;  // by slot of a body
  std::vector<uint32_t> filled_;                  // slots with triangles
};

}  // namespace offstage::sim
