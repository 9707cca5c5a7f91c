#pragma once
/// Limits, motors, friction, damping and springs of joints as rows with bounds (physics A6, A8).

#include <optional>
#include <vector>

#include "sim/articulation/articulation.h"
#include "sim/articulation/joint_problem.h"

namespace offstage::sim {

/// The joint from which a bounded row was made.
struct BoundedOrigin {
  Joint* joint;
  std::size_t slot;  ///< index of the row in Joint::efforts
  Vec3 arm;          ///< vector from the centre of the joint's body a to the anchor, world axes [m]
  /// Weight of the end's velocities in the motion of the bodies, from 0 to 1. 0: they move with the mean of
  /// the velocities at the interval's start and end. 1: they move with their new velocities during the whole
  /// interval, so that the joint reaches a given coordinate exactly at the interval's end.
  Real end_weight;
};

/// Returns the fraction of an interval after which the free motion of an articulation first reaches a limit,
/// from 0 to 1; empty if it reaches no limit. The interval lasts `duration` [s] and ends at `time`. Call
/// Articulation::place_within() first.
std::optional<Real> first_stop(const Articulation& articulation, Real duration, Real time);

/// Returns the fraction of an interval after which an articulation first rebounds from a limit, from 0 to 1,
/// if Articulation::traces_rebounds() and its joints reach such a limit in the interval. The interval lasts
/// `duration` [s] and ends at `time`. Call Articulation::place_within() first.
std::optional<Real> first_rebound(const Articulation& articulation, Real duration, Real time);

/// Lets the joints of an articulation rebound from the limits that they have reached at `time`: changes the
/// velocities at the interval's start.
void rebound(Articulation& articulation, Real time);

/// Appends the bounded rows of an articulation for an interval that lasts `duration` [s] and ends at `time`.
/// Call Articulation::place_within() first. The indices of bodies are Body::row.
void collect_bounded_rows(Articulation& articulation, Real duration, Real time, std::vector<BoundedRow>& rows,
                          std::vector<BoundedOrigin>& origins);

/// Appends rows for springs and dampers, which resist changes of the free motion (physics A8). `duration` is
/// the length of the interval [s]. For a collision it is the length of the sub-step: springs that are stiff
/// over a sub-step resist a collision equally.
void collect_springs(const Articulation& articulation, Real duration, Real time,
                     std::vector<BoundedRow>& rows, std::vector<BoundedOrigin>& origins);

/// Appends the rows of reached limits, for a collision at `time`.
void collect_stops(const Articulation& articulation, Real time, std::vector<BoundedRow>& rows,
                   std::vector<BoundedOrigin>& origins);

}  // namespace offstage::sim
