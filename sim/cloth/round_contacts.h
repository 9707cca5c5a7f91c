#pragma once
/// Contact of rounded bodies (spheres, capsules, cylinders, cones) with triangles of cloth. Points alone keep
/// a triangle out of a body whose radius is large against the triangle; a thin rod or a small ball would pass
/// between them. The place of a triangle that is nearest to the body's axis is swept along the path of both.

#include <optional>
#include <span>
#include <vector>

#include "sim/cloth/cloth_bodies.h"
#include "sim/cloth/cloth_tree.h"
#include "sim/cloth/triangle_contact.h"

namespace offstage::sim {

class RoundContacts {
 public:
  /// Whether a triangle whose corners keep the distance `thickness` from the shape can nevertheless come too
  /// near to the shape between its corners, or let the shape pass. `edge`: greatest length of its edges [m].
  static bool concerns(const Solid& solid, Real edge, Real thickness);

  void clear() { near_.clear(); }
  /// Adds a triangle and a body that can meet in this sub-step of the world.
  void add(uint32_t triangle, uint32_t body) { near_.push_back({triangle, body}); }
  /// Moves triangles out of the bodies in a sub-step of cloth of length dt. Appends to `cuts`.
  void solve(std::span<const Triangle> triangles, ClothPoints& points, std::span<ClothBody> bodies, Real dt,
             std::vector<VelocityCut>& cuts) const;
  /// Returns the contacts with dynamic bodies at the points' current positions, including triangles that are
  /// up to `reach` thicknesses of the cloth beyond the distance that they keep.
  void collect(std::span<const Triangle> triangles, const ClothPoints& points, std::span<ClothBody> bodies,
               Real reach, std::vector<BodyContact>& found) const;

 private:
  struct Near {
    uint32_t triangle, body;
  };

  static std::optional<TriangleContact> touch(const Triangle& t, const ClothPoints& points,
                                              const ClothBody& body, Real reach);

  std::vector<Near> near_;
};

}  // namespace offstage::sim
