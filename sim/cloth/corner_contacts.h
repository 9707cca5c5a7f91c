#pragma once
/// Contacts of triangles of cloth with bodies: with the corners and edges of boxes, the rims of cylinders and
/// cones, the vertices of meshes' hulls, and with rounded bodies (round_contacts.h). cloth_contacts.h keeps
/// the points of cloth out of bodies; these contacts keep out the triangles between the points.

#include <span>
#include <vector>

#include "sim/cloth/cloth_bodies.h"
#include "sim/cloth/cloth_contacts.h"
#include "sim/cloth/cloth_tree.h"
#include "sim/cloth/round_contacts.h"

namespace offstage::sim {

class CornerContacts {
 public:
  /// Sets the triangles, those of cloths that collide with bodies.
  void assign(std::vector<Triangle> triangles, const ClothPoints& points);
  /// Finds the features and triangles that can meet in a sub-step of the world of length h.
  void find(const ClothPoints& points, std::span<ClothBody> bodies, Real h);
  Real mean_edge() const { return 2 * spacing_; }  ///< mean length of the triangles' edges [m]
  /// Separates features and triangles in a sub-step of cloth of length dt. Appends to `cuts`.
  void solve(ClothPoints& points, Real dt, std::vector<VelocityCut>& cuts);
  /// Returns the contacts of rounded dynamic bodies with triangles at the points' current positions,
  /// including triangles that are up to `reach` thicknesses of the cloth beyond the distance that they keep.
  void collect(const ClothPoints& points, Real reach, std::vector<BodyContact>& found) {
    round_.collect(triangles_, points, bodies_, reach, found);
  }

 private:
  /// A sample of a feature, in the body's frame.
  struct Corner {
    Vec3 place, outward;
    Real depth;  // greatest depth at which cloth behind the feature still counts as coming from outside [m]
  };
  struct Near {
    Corner corner;
    uint32_t body, triangle;
  };

  std::vector<Corner> corners(const Solid& solid) const;
  void press(ClothPoints& points, const Near& near, Real dt, std::vector<VelocityCut>& cuts);

  std::vector<Triangle> triangles_;
  ClothTree tree_;
  Real spacing_ = 0;                 // of samples: half a mean edge of the cloths [m]
  Real longest_ = 0, thinnest_ = 0;  // edge and thickness of the cloths [m]
  RoundContacts round_;
  std::span<ClothBody> bodies_;
  std::vector<Near> near_;
};

}  // namespace offstage::sim
