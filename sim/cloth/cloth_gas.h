#pragma once
/// Gas inside a closed cloth under pressure. It leaks through the holes of tears (physics F8).

#include <cstdint>
#include <span>
#include <vector>

#include "sim/core/types.h"
#include "sim/geometry/mesh.h"

namespace offstage::sim {

class ClothGas {
 public:
  /// Finds the holes of a cloth: the borders of its triangles, whose normals must point outwards. Call it
  /// after the cloth has torn.
  void assign(std::span<const Triangle> triangles);

  bool has_holes() const { return !holes_.empty(); }
  /// Volume inside, with each hole closed by a fan around the centre of its border [m^3].
  Real volume(std::span<const Vec3> points, std::span<const Triangle> triangles) const;
  /// Returns the sum of the areas of the holes [m^2]. The area of a hole is the length of its area vector.
  Real hole_area(std::span<const Vec3> points) const;

  /// Fraction of the gas that has not leaked out, 0 to 1. The overpressure at a given volume is proportional
  /// to this fraction.
  Real remaining_fraction() const { return remaining_fraction_; }
  /// Lets gas flow out for a time h [s]. `pressure`: overpressure at this volume if no gas had leaked yet
  /// [Pa]. `density`: density of the gas [kg/m^3], > 0. By Bernoulli's equation the gas leaves at the speed
  /// sqrt(2 p / density) through the fraction kDischarge of the area of the holes.
  void leak(std::span<const Vec3> points, Real volume, Real pressure, Real density, Real h);

  /// Coefficient of discharge of a hole with a sharp edge (Batchelor, An Introduction to Fluid
  /// Dynamics, 5.12: about 0.6).
  static constexpr Real kDischarge = 0.6;

 private:
  struct Edge {
    uint32_t from, to;  // in the direction of the edge's triangle
  };
  /// A hole: a range of the edges, which form one border.
  struct Hole {
    std::size_t first, end;
  };
  Vec3 centre(const Hole& hole, std::span<const Vec3> points) const;

  std::vector<Edge> edges_;  // by hole
  std::vector<Hole> holes_;
  Real remaining_fraction_ = 1;
};

}  // namespace offstage::sim
