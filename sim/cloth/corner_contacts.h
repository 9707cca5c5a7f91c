#pragma once
/// Contacts of cloth triangles with features of bodies: corners and edges of boxes, rims of cylinders and
/// cones, hull vertices of meshes, and rounded bodies (round_contacts.h). cloth_contacts.h keeps the points
/// of cloth out of bodies; the contacts here do so for the triangles between the points.

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "sim/cloth/cloth_bodies.h"
#include "sim/cloth/cloth_contacts.h"
#include "sim/cloth/cloth_tree.h"
#include "sim/cloth/round_contacts.h"

namespace offstage::sim {

class CornerContacts {
 public:
  /// Sets the triangles of all cloths that collide with bodies.
  void assign(std::vector<Triangle> triangles, const ClothPoints& points);
  /// Finds the pairs of features and triangles that can touch in a part of a sub-step of the world. This part
  /// covers the fractions `from` to `to` of the sub-step and lasts h [s]; the points are at its start.
  /// `of_points`: contacts of the same points. Triangles that pins hold inside a body have no contacts with
  /// it.
  void find(const ClothPoints& points, const ClothContacts& of_points, std::span<ClothBody> bodies, Real from,
            Real to, Real h);
  Real mean_edge() const { return 2 * spacing_; }  ///< mean length of the triangles' edges [m]
  /// Finds the supports of triangles (ClothPoints::triangle_supports) for a sub-step of the cloth of length
  /// dt [s]. `of_points`: contacts of the same points.
  void find_supports(ClothPoints& points, const ClothContacts& of_points, Real dt) const;
  /// Separates features and triangles in a sub-step of the cloth of length dt [s]. Displacements that must
  /// not count as velocity are appended to `cuts`. Cloth that a body presses against another one is left out.
  void solve(ClothPoints& points, const ClothContacts& of_points, Real dt, std::vector<VelocityCut>& cuts);
  /// Returns the contacts of dynamic bodies with triangles at the points' current positions, including
  /// triangles whose distance exceeds the contact distance by up to `reach` times the thickness of the cloth.
  void collect(const ClothPoints& points, const ClothContacts& of_points, Real reach,
               std::vector<BodyContact>& found) const;

 private:
  /// A sample of a feature, in the body's frame.
  struct Corner {
    Vec3 place, outward;
    Real depth;  // greatest depth at which cloth behind the feature still counts as coming from outside [m]
    uint32_t body = 0;
  };
  /// A pair of a feature and a triangle. All pairs of a feature are together.
  struct Near {
    uint32_t corner, triangle;
  };
  /// Places of features at the end of the cloth's sub-step. Each is computed once for all of its pairs.
  class Places {
   public:
    explicit Places(const CornerContacts& of) : of_(of) {}
    const Vec3& of(uint32_t corner);
    void forget() { known_.reset(); }  ///< Bodies have moved.

   private:
    const CornerContacts& of_;
    std::optional<uint32_t> known_;
    Vec3 place_ = Vec3::Zero();
  };

  std::vector<Corner> corners(const Solid& solid) const;
  /// Returns the contact of a feature at the place `p` if the distance of a triangle with its corners at `at`
  /// exceeds the contact distance by less than `reach` [m], and no weight is below -`overhang`.
  std::optional<TriangleContact> touch(const Corner& corner, const Vec3& p, const std::array<Vec3, 3>& at,
                                       Real thickness, Real reach, Real overhang) const;

  std::vector<Triangle> triangles_;
  ClothTree tree_;
  Real spacing_ = 0;                 // distance of samples: half a mean edge of the cloths [m]
  Real longest_ = 0, thinnest_ = 0;  // longest edge and smallest thickness of the cloths [m]
  RoundContacts round_;
  std::span<ClothBody> bodies_;
  std::vector<Corner> corners_;  // those with pairs
  std::vector<Near> near_;
};

}  // namespace offstage::sim
