#pragma once
/// Contact of rounded bodies (spheres, capsules, cylinders, cones) with triangles of cloth. If the radius of
/// a body is large compared with the triangles, the contacts of points are sufficient. A thin rod or a small
/// ball, however, would pass between the points. For these bodies, the point of a triangle that is nearest to
/// the body's axis is swept along the paths of both.

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "sim/cloth/cloth_bodies.h"
#include "sim/cloth/cloth_tree.h"
#include "sim/cloth/triangle_contact.h"

namespace offstage::sim {

class RoundContacts {
 public:
  /// Whether contacts at corners are not sufficient: a triangle whose corners keep the distance `thickness`
  /// [m] from the shape may still get too close to it, or let it pass. `edge`: greatest length of the
  /// triangle's edges [m].
  static bool concerns(const Solid& solid, Real edge, Real thickness);

  void clear() { near_.clear(); }
  /// Adds a triangle and a body that can touch in this sub-step of the world, by index.
  void add(uint32_t triangle, uint32_t body) { near_.push_back({triangle, body}); }
  /// Moves triangles out of the bodies in a sub-step of the cloth of length dt [s]. Displacements that must
  /// not count as velocity are appended to `cuts`. Triangles t for which is_pressed(t, body) is true are left
  /// out.
  void solve(std::span<const Triangle> triangles, ClothPoints& points, std::span<ClothBody> bodies, Real dt,
             std::vector<VelocityCut>& cuts,
             const std::function<bool(const Triangle&, const ClothBody&)>& is_pressed) const;
  /// Returns the contacts with dynamic bodies at the points' current positions, including triangles whose
  /// distance exceeds the contact distance by up to `reach` times the thickness of the cloth. `is_pressed`:
  /// as in solve().
  void collect(std::span<const Triangle> triangles, const ClothPoints& points, std::span<ClothBody> bodies,
               Real reach, const std::function<bool(const Triangle&, const ClothBody&)>& is_pressed,
               std::vector<BodyContact>& found) const;

  /// Calls visit(triangle, body) for each pair, with their indices.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (const Near& near : near_) visit(near.triangle, near.body);
  }
  /// Returns the contact of a triangle whose corners move to `ends`, if its distance exceeds the contact
  /// distance by less than `reach` [m]. `is_short`: only if the path is short compared with the body's
  /// radius, so that the direction of the contact hardly changes.
  static std::optional<TriangleContact> touch(const Triangle& t, const ClothPoints& points,
                                              const std::array<Vec3, 3>& ends, const ClothBody& body,
                                              Real reach, bool is_short);

 private:
  struct Near {
    uint32_t triangle, body;
  };

  std::vector<Near> near_;
};

}  // namespace offstage::sim
