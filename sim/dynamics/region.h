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
/// Aligned with the world's axes; f belongs to the axis along which the point is nearest to the edge.
struct BoxRegion {
  Vec3 centre = Vec3::Zero();
  Vec3 size = Vec3::Ones();  ///< full edges [m], > 0
};
using Region = std::variant<Everywhere, SphereRegion, BoxRegion>;

/// 1 - |f|/R in a sphere, the smallest 1 - |f_i|/(b_i/2) in a box, to the power `drop_rate`; 0 outside.
Real strength(const Region& region, uint32_t drop_rate, const Vec3& point);
/// The strengths at several points (x y z of each); returns whether any strength is not 0.
bool strengths(const Region& region, uint32_t drop_rate, std::span<const Real> points, std::span<Real> out);
/// Strength at a fraction `depth` of the distance from the edge of the region to its middle.
Real strength_at_depth(Real depth, uint32_t drop_rate);

}  // namespace offstage::sim
