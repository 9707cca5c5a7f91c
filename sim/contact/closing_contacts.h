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
  std::vector<ContactBody> bodies;          ///< bodies with their velocities at the interval's end
  std::vector<Contact> contacts;            ///< contacts with their impulses over the whole interval
  std::vector<Displacement> displacements;  ///< displacement of each body in the interval
  ContactWork work;
};

/// Solves an interval of length `duration` [s]. `start` has the velocities at its start and `free` those at
/// its end without contacts; `contacts` have the targets of points that touch, and guesses of their impulses
/// over the interval. Points with a gap push from the time on at which it closes, without rebound. There is
/// no result if they close at more than eight times, or if a solution fails, costs too much or adds energy.
std::optional<ClosingSolution> solve_closing(std::span<const ContactBody> start,
                                             std::span<const ContactBody> free,
                                             std::span<const Contact> contacts,
                                             std::span<const ClosingPoint> points, Real duration,
                                             ProximalNewton& newton);

}  // namespace offstage::sim
