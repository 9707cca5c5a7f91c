#pragma once
/// Limits, motors, friction, damping and springs of joints as rows with bounds (physics A6, A8).

#include <optional>
#include <vector>

#include "sim/articulation/articulation.h"
#include "sim/articulation/joint_problem.h"

namespace offstage::sim {

/// Origin of a row with bounds.
struct BoundedOrigin {
  Joint* joint;
  std::size_t slot;  ///< index of the row in Joint::efforts
  Vec3 arm;          ///< vector from the centre of the joint's body a to the anchor, world axes [m]
  /// Whether the row changes the joint's speed so that it reaches its coordinate at the interval's end. The
  /// bodies then move with their new velocities during the whole interval.
  bool closes;
};

/// The fraction of an interval that ends at `time` after which the free motion of an articulation first
/// reaches a limit, after its place_within(); none if it reaches no limit.
std::optional<Real> first_stop(const Articulation& articulation, Real duration, Real time);

/// Appends the bounded rows of an articulation, after its place_within(), for an interval that ends at
/// `time`. Its bodies have the indices Body::row.
void collect_bounded_rows(const Articulation& articulation, Real duration, Real time,
                          std::vector<BoundedRow>& rows, std::vector<BoundedOrigin>& origins);

/// Appends rows by which the springs and dampers resist changes of the free motion (physics A8), for an
/// interval of this duration, or for a collision in a sub-step of this duration: links that springs make
/// stiff in a sub-step are so in a collision, too.
void collect_springs(const Articulation& articulation, Real duration, Real time,
                     std::vector<BoundedRow>& rows, std::vector<BoundedOrigin>& origins);

/// Appends the rows of reached limits, for a collision at `time`.
void collect_stops(const Articulation& articulation, Real time, std::vector<BoundedRow>& rows,
                   std::vector<BoundedOrigin>& origins);

}  // namespace offstage::sim
