#pragma once
/// Contacts that close within an interval while other contacts already support a body (physics R9).
///
/// If a whole interval is solved at once, a contact that closes within the interval pushes from the start,
/// before the body has reached the surface. A ball that rolls over the concave seams of a bowl then loses a
/// little energy at each seam: the work of its weight over the gap. To avoid this, the interval is divided at
/// the times at which contacts close. The frames and arms of the contacts stay constant.

#include <optional>
#include <span>
#include <vector>

#include "sim/contact/contact_problem.h"
#include "sim/contact/proximal_newton.h"

namespace offstage::sim {

/// Motion of a contact point within an interval, in the contact's frame.
struct ClosingPoint {
  Real gap = 0;                 ///< distance at the start [m]; 0: the point touches
  Vec3 surface = Vec3::Zero();  ///< velocity of conveyors [m/s]
  /// Coefficients of Contact::bias as a polynomial of the elapsed fraction of the interval, from 0 to 1;
  /// lowest degree first [m/s].
  Vec3 bias[3] = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};

  Vec3 bias_at(Real part) const { return bias[0] + part * (bias[1] + part * bias[2]); }
};

/// Displacement of a body in an interval: `shift` of its centre of mass [m], and `turn`, a small rotation
/// vector [rad].
struct Displacement {
  Vec3 shift = Vec3::Zero(), turn = Vec3::Zero();
};

struct ClosingSolution {
  std::vector<ContactBody> bodies;  ///< bodies with their velocities at the interval's end
  // Contacts and bounded rows, with their impulses over the whole interval.
  std::vector<Contact> contacts;
  std::vector<BoundedRow> bounded;
  std::vector<Vec6> constraints;            ///< impulses of the joint constraints over the interval
  std::vector<Displacement> displacements;  ///< displacement of each body in the interval
  ContactWork work;
};

/// The contacts and joints of an interval of length `duration` [s].
struct ClosingProblem {
  std::span<const ContactBody> start;  ///< bodies with their velocities at the start of the interval
  std::span<const ContactBody>
      free;  ///< bodies with the velocities that they would have at the end without contacts and bounded rows
  /// Contacts with initial guesses of the impulses over the interval. Only points that touch at the start
  /// have targets.
  std::span<const Contact> contacts;
  std::span<const ClosingPoint> points;  ///< motion of each contact
  /// Joints, with initial guesses of the impulses. Rows that act only in a part of the interval, such as
  /// limits, are not allowed.
  JointProblem joints;
  Real duration;
  Real budget;  ///< greatest cost of the solution [ns, see ProximalNewton::cost()]
};

/// Solves an interval in pieces. A point with a gap pushes from the time at which the gap closes, and does
/// not rebound. A point that separates does not push until it closes again. Returns no result if there are
/// more than 64 closing times, if a solution fails or adds energy, or if the total cost exceeds the budget.
/// `cost` is the cost in any case [ns].
std::optional<ClosingSolution> solve_closing(const ClosingProblem& problem, ProximalNewton& newton,
                                             Real& cost);

}  // namespace offstage::sim
