#pragma once
/// Regions of fields, and how the strength of a field decreases towards their edges (physics P2).

#include <cstdint>
#include <span>
#include <variant>

#include "sim/core/types.h"

namespace offstage::sim {

/// The strength in a region is f^p, where f decreases linearly from 1 in the middle to 0 at the edge, and p
/// is the field's drop rate; with drop rate 0 it is 1 throughout.
struct Everywhere {};
struct SphereRegion {
  Vec3 centre = Vec3::Zero();
  Real radius = 1;  ///< [m], > 0
};
/// A box aligned with the world's axes; f is the smallest value over the three axes.
struct BoxRegion {
  Vec3 centre = Vec3::Zero();
  Vec3 size = Vec3::Ones();  ///< full edges [m], > 0
};
using Region = std::variant<Everywhere, SphereRegion, BoxRegion>;

/// Returns the strength at a point: d^drop_rate, where d is 1 - |r|/R in a sphere, and the smallest 1 -
/// |r_i|/(b_i/2) in a box. r is the vector from the centre; the strength is 0 outside.
Real strength(const Region& region, uint32_t drop_rate, const Vec3& point);
/// Computes the strengths at several points (x y z of each) in `out`. Returns whether any strength is not 0.
bool strengths(const Region& region, uint32_t drop_rate, std::span<const Real> points, std::span<Real> out);
/// Returns the strength at a depth below the edge of the region: `depth` is 0 at the edge and 1 in the
/// middle.
Real strength_at_depth(Real depth, uint32_t drop_rate);

}  // namespace offstage::sim
