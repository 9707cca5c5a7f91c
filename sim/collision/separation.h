#pragma once
/// Result of a distance query for two convex solids; all algorithms use this type.

#include "sim/core/types.h"

namespace offstage::sim {

/// Closest points of two solids A and B, or the witness points of the penetration depth if they overlap, in
/// A's frame. Moving A by `-distance * normal`, or B by `distance * normal`, brings separate solids into
/// contact, and separates overlapping ones with the smallest translation (up to the tolerance of the
/// algorithm).
struct Separation {
  Real distance = 0;            ///< [m]; negative: penetration depth
  Vec3 normal = Vec3::UnitY();  ///< unit vector from B to A: an approaching pair has (v_A - v_B).n < 0
  Vec3 on_a = Vec3::Zero();     ///< closest point on the surface of A
  Vec3 on_b = Vec3::Zero();     ///< closest point on the surface of B; on_a - on_b = distance * normal
  int iterations = 0;           ///< iterations of the algorithm, for benchmarks and statistics
  bool converged = true;  ///< false: the bounded iteration ended early; the values are its best estimate
};

}  // namespace offstage::sim
