#pragma once
/// Contacts that close while other contacts carry a body (physics R9).
///
/// One solution for a whole interval carries a body by the contact that closes from the start on, although
/// the body comes there only later. A ball that rolls over the concave seams of a bowl then loses the work
/// of its weight over the gap at each seam. Here the interval is divided at the times at which contacts
/// close; the contacts keep their frames and arms.

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
  /// Coefficients of the bias (Contact::bias) as a polynomial of the elapsed part of the interval [m/s].
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
  // With their impulses over the whole interval:
  std::vector<Contact> contacts;
  std::vector<BoundedRow> bounded;
  std::vector<Vec6> constraints;            ///< impulses of the joints' constraints
  std::vector<Displacement> displacements;  ///< displacement of each body in the interval
  ContactWork work;
};

/// An interval of length `duration` [s].
struct ClosingProblem {
  std::span<const ContactBody> start;  ///< velocities at its start
  std::span<const ContactBody> free;   ///< and at its end, without contacts and bounded rows
  /// With the targets of points that touch, and guesses of their impulses over the interval.
  std::span<const Contact> contacts;
  std::span<const ClosingPoint> points;  ///< of the contacts
  /// Impulses are guesses. Rows that act only in a part of the interval, as limits do, are not accepted.
  JointProblem joints;
  Real duration;
  Real budget;  ///< greatest cost of the solution [ns, see ProximalNewton::cost()]
};

/// Solves an interval in pieces. Points with a gap push from the time on at which it closes, without rebound.
/// There is no result if they close at more than eight times, or if a solution fails or adds energy, or if
/// all together cost too much.
std::optional<ClosingSolution> solve_closing(const ClosingProblem& problem, ProximalNewton& newton);

}  // namespace offstage::sim
