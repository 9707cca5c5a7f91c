#pragma once
/// Limits, motors, friction and damping of joints as rows with bounds (physics A6).

#include <vector>

#include "sim/articulation/articulation.h"
#include "sim/articulation/joint_problem.h"

namespace offstage::sim {

/// Where the row of a joint with bounds comes from.
struct BoundedOrigin {
  Joint* joint;
  std::size_t slot;  ///< in Joint::efforts
  Vec3 arm;          ///< from the centre of the joint's body a to the anchor, world [m]
  /// It says where the joint may be at the interval's end, not how it moves until then.
  bool is_stop;
};

/// The rows of an articulation, after its place(), for an interval of a length that ends at `time`. Its
/// bodies have the indices Body::row. Appends.
void collect_bounded_rows(const Articulation& articulation, Real duration, Real time,
                          std::vector<BoundedRow>& rows, std::vector<BoundedOrigin>& origins);

/// Those of limits that are reached, for a collision at `time`.
void collect_stops(const Articulation& articulation, Real time, std::vector<BoundedRow>& rows,
                   std::vector<BoundedOrigin>& origins);

}  // namespace offstage::sim
