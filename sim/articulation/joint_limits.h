#pragma once
/// Limits, motors, friction and damping of joints as rows with bounds (physics A6).

#include <vector>

#include "sim/articulation/articulation.h"
#include "sim/articulation/joint_problem.h"

namespace offstage::sim {

/// Origin of a row with bounds.
struct BoundedOrigin {
  Joint* joint;
  std::size_t slot;  ///< index in Joint::efforts
  Vec3 arm;          ///< from the centre of the joint's body a to the anchor, world [m]
  /// The row limits the coordinate at the interval's end, not the velocity during the interval.
  bool is_stop;
};

/// Appends the bounded rows of an articulation, after its place(), for an interval that ends at `time`. Its
/// bodies have the indices Body::row.
void collect_bounded_rows(const Articulation& articulation, Real duration, Real time,
                          std::vector<BoundedRow>& rows, std::vector<BoundedOrigin>& origins);

/// Appends the rows of reached limits, for a collision at `time`.
void collect_stops(const Articulation& articulation, Real time, std::vector<BoundedRow>& rows,
                   std::vector<BoundedOrigin>& origins);

}  // namespace offstage::sim
