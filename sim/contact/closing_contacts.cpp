#include "sim/contact/closing_contacts.h"

#include <algorithm>
#include <cmath>

namespace offstage::sim {
namespace {

/// Greatest number of times at which contacts close, and cost of a solution [ns, see ProximalNewton::cost()].
constexpr int kMostClosings = 8;
constexpr Real kMostCost = 5e5;
/// Smaller gaps are closed [m].
constexpr Real kClosed = 1e-11;
/// Part of the kinetic energy that a solution may add by rounding.
constexpr Real kClosingRounding = 1e-9;

/// Time at which a gap closes that changes at the rate `first`, which reaches `last` after `rest`; at least
/// 0, and more than `rest` if it does not close.
Real closing_time(Real gap, Real first, Real last, Real rest) {
  const Real never = 2 * rest, curve = (last - first) / (2 * rest);
  // gap + first t + curve t^2 = 0, by the form that is accurate for small curves.
  const Real root = first * first - 4 * curve * gap;
  if (root < 0) return never;
  const Real sum = -first + std::sqrt(root);
  if (!(sum > 0)) return never;
  return 2 * gap / sum;
}

/// State of the solution at a time of the interval.
class Pieces {
 public:
  Pieces(std::span<const ContactBody> start, std::span<const ContactBody> free,
         std::span<const Contact> contacts, std::span<const ClosingPoint> points, Real duration,
         ProximalNewton& newton)
      : start_(start),
        free_(free),
        contacts_(contacts),
        points_(points),
        duration_(duration),
        newton_(newton),
        now_(start.begin(), start.end()) {
    result_.contacts.assign(contacts.begin(), contacts.end());
    for (Contact& c : result_.contacts) c.impulse = c.moment = Vec3::Zero();
    result_.displacements.resize(start.size());
    for (const ClosingPoint& p : points) gaps_.push_back(p.gap);
  }

  std::optional<ClosingSolution> solve() {
    for (int closings = 0; closings <= kMostClosings; ++closings) {
      if (!close() || !solve_rest()) return {};
      const Real rest = duration_ - time_, closing = next_closing();
      advance(std::min(closing, rest));
      if (closing >= rest) {
        result_.bodies = now_;
        return result_;
      }
    }
    return {};
  }

 private:
  /// Solves the closed contacts in bodies_, whose velocities do not contain their impulses.
  bool solve_closed(Real part, bool at_once) {
    closed_.clear();
    rows_.clear();
    for (uint32_t i = 0; i < contacts_.size(); ++i) {
      if (gaps_[i] > 0) continue;
      Contact c = contacts_[i];
      c.bias = points_[i].bias_at(part);
      c.offset = points_[i].surface + c.bias;
      c.target = at_once || points_[i].gap > 0 ? 0 : c.target;
      c.is_guessed = c.is_guessed && !at_once;
      c.impulse = at_once ? Vec3(Vec3::Zero()) : Vec3((1 - time_ / duration_) * c.impulse);
      closed_.push_back(c);
      rows_.push_back(i);
    }
    const std::vector<ContactBody> before = bodies_;
    const std::optional<ContactWork> work = newton_.solve(bodies_, closed_, {}, kMostCost);
    if (!work || work->fallbacks > 0) return false;
    result_.work.add(*work);
    return at_once ? added_energy(before, bodies_, closed_) <= kClosingRounding * kinetic_energy(before)
                   : true;
  }
  /// Adds a part of the impulses of the last solution.
  void add_impulses(Real part) {
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      result_.contacts[rows_[k]].impulse += part * closed_[k].impulse;
      result_.contacts[rows_[k]].moment += part * closed_[k].moment;
    }
  }
  /// Solves from now to the end of the interval with the contacts that are closed.
  bool solve_rest() {
    const Real part = 1 - time_ / duration_;
    bodies_ = now_;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      bodies_[i].velocity += part * (free_[i].velocity - start_[i].velocity);
      bodies_[i].angular_velocity += part * (free_[i].angular_velocity - start_[i].angular_velocity);
    }
    return solve_closed(1, false);
  }
  Real speed(uint32_t i, std::span<const ContactBody> bodies) const {
    const Contact& c = contacts_[i];
    return c.frame.n.dot(bodies[c.a].velocity_at(c.arm_a) - bodies[c.b].velocity_at(c.arm_b)) +
           points_[i].surface.x();
  }
  Real next_closing() const {
    const Real rest = duration_ - time_;
    Real next = 2 * rest;
    for (uint32_t i = 0; i < contacts_.size(); ++i)
      if (gaps_[i] > 0)
        next = std::min(next, closing_time(gaps_[i], speed(i, now_), speed(i, bodies_), rest));
    return next;
  }
  /// Moves by a time, with velocities that change at a constant rate to those of bodies_.
  void advance(Real duration) {
    const Real part = duration / (duration_ - time_);
    add_impulses(part);
    std::vector<ContactBody> next = now_;
    for (std::size_t i = 0; i < now_.size(); ++i) {
      next[i].velocity += part * (bodies_[i].velocity - now_[i].velocity);
      next[i].angular_velocity += part * (bodies_[i].angular_velocity - now_[i].angular_velocity);
      Displacement& d = result_.displacements[i];
      d.shift += duration / 2 * (now_[i].velocity + next[i].velocity);
      d.turn += duration / 2 * (now_[i].angular_velocity + next[i].angular_velocity);
    }
    for (uint32_t i = 0; i < contacts_.size(); ++i)
      if (gaps_[i] > 0) {
        gaps_[i] += duration / 2 * (speed(i, now_) + speed(i, next));
        if (gaps_[i] <= kClosed) gaps_[i] = 0;
      }
    now_ = std::move(next);
    time_ += duration;
  }
  /// Stops the approach of the closed contacts.
  bool close() {
    bodies_ = now_;
    if (!solve_closed(time_ / duration_, true)) return false;
    add_impulses(1);
    now_ = bodies_;
    return true;
  }

  const std::span<const ContactBody> start_, free_;
  const std::span<const Contact> contacts_;
  const std::span<const ClosingPoint> points_;
  const Real duration_;
  ProximalNewton& newton_;
  ClosingSolution result_;
  Real time_ = 0;
  std::vector<Real> gaps_;                 // now; 0: closed
  std::vector<ContactBody> now_, bodies_;  // velocities now, and at the end of the interval
  std::vector<Contact> closed_;
  std::vector<uint32_t> rows_;  // index of each of them
};

}  // namespace

std::optional<ClosingSolution> solve_closing(std::span<const ContactBody> start,
                                             std::span<const ContactBody> free,
                                             std::span<const Contact> contacts,
                                             std::span<const ClosingPoint> points, Real duration,
                                             ProximalNewton& newton) {
  return Pieces(start, free, contacts, points, duration, newton).solve();
}

}  // namespace offstage::sim
