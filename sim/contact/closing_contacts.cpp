#include "sim/contact/closing_contacts.h"

#include <algorithm>
#include <cmath>

namespace offstage::sim {
namespace {

/// Greatest number of times in an interval at which contacts close.
constexpr int kMostClosings = 64;
/// Gaps smaller than kClosed count as closed [m]. Contacts close together if their closing times differ by
/// less than the fraction kTogether of the interval: apart from rounding, all points of a wheel reach a seam
/// of a surface at the same time.
constexpr Real kClosed = 1e-11, kTogether = 1e-3;
/// Contacts that approach at a lower speed than this need not be stopped [m/s].
constexpr Real kStopped = 1e-9;
/// A closed contact whose surfaces separate faster than this opens [m/s]. The speed of a contact that turns
/// is uncertain by the fraction kTurningShare of the change of its velocity in the interval.
constexpr Real kOpening = 1e-3, kTurningShare = 0.25;
/// Fraction of the kinetic energy that a solution may add because of rounding.
constexpr Real kClosingRounding = 1e-9;

/// Returns the time until a gap [m] closes [s], at least 0, or more than `rest` if it does not close. The
/// speed at which the gap changes [m/s] is `first` now and `last` after the time `rest`, and linear in
/// between.
Real closing_time(Real gap, Real first, Real last, Real rest) {
  const Real never = 2 * rest, curve = (last - first) / (2 * rest);
  // Solves gap + first t + curve t^2 = 0 for the later root if the gap grows at first, else for the earlier
  // one, by the formula that is accurate for small curves.
  const Real root = first * first - 4 * curve * gap;
  if (root < 0) return never;
  if (first > 0) return curve < 0 ? (first + std::sqrt(root)) / (-2 * curve) : never;
  const Real sum = -first + std::sqrt(root);
  if (!(sum > 0)) return never;
  return 2 * gap / sum;
}

/// Solves an interval in pieces, from one closing of contacts to the next. The state is always the state at
/// the current time.
class Pieces {
 public:
  Pieces(const ClosingProblem& problem, ProximalNewton& newton)
      : problem_(problem), newton_(newton), now_(problem.start.begin(), problem.start.end()) {
    result_.contacts.assign(problem.contacts.begin(), problem.contacts.end());
    for (Contact& c : result_.contacts) c.impulse = c.moment = Vec3::Zero();
    result_.bounded.assign(problem.joints.bounded.begin(), problem.joints.bounded.end());
    for (BoundedRow& r : result_.bounded) r.impulse = 0;
    result_.constraints.assign(problem.joints.impulses.size(), Vec6::Zero());
    result_.displacements.resize(now_.size());
    for (const ClosingPoint& p : problem.points) gaps_.push_back(p.gap);
    for (const Contact& c : problem.contacts) guesses_.push_back(c.impulse);
    for (const Real gap : gaps_) open_.push_back(gap > 0);
    closing_.resize(gaps_.size());
  }

  std::optional<ClosingSolution> solve() {
    for (int closings = 0; closings <= kMostClosings; ++closings) {
      if (!close()) return {};
      open();
      if (!solve_rest()) return {};
      const Real rest = problem_.duration - time_, closing = next_closing();
      advance(std::min(closing, rest));
      if (closing >= rest) {
        result_.bodies = now_;
        return result_;
      }
    }
    return {};
  }
  Real cost() const { return cost_; }  ///< [ns]

 private:
  /// Solves the closed contacts and the joints: for the rest of the interval, or for an impact at the current
  /// time if `now`. bodies_ must hold the velocities without the impulses of this solution; it then holds the
  /// velocities with them. Returns false if the solver failed or the impact would add energy.
  bool solve_closed(bool now) {
    const Real elapsed = time_ / problem_.duration;
    closed_.clear();
    rows_.clear();
    for (uint32_t i = 0; i < problem_.contacts.size(); ++i) {
      if (open_[i]) continue;
      Contact c = problem_.contacts[i];
      c.bias = problem_.points[i].bias_at(now ? elapsed : 1);
      c.offset = problem_.points[i].surface + c.bias;
      c.target = now || problem_.points[i].gap > 0 ? 0 : c.target;
      c.is_guessed = c.is_guessed && !now;
      c.impulse = now ? Vec3(Vec3::Zero()) : Vec3((1 - elapsed) * guesses_[i]);
      closed_.push_back(c);
      rows_.push_back(i);
    }
    bounded_.assign(problem_.joints.bounded.begin(), problem_.joints.bounded.end());
    for (BoundedRow& row : bounded_) set_row(row, now);
    reactions_.clear();
    for (const Vec6& p : problem_.joints.impulses)
      reactions_.push_back(now ? Vec6(Vec6::Zero()) : Vec6((1 - elapsed) * p));
    const std::vector<ContactBody> before = bodies_;
    const std::optional<ContactWork> work = newton_.solve(
        bodies_, closed_, {problem_.joints.constraints, bounded_, reactions_}, problem_.budget - cost_);
    cost_ += newton_.cost();
    if (!work || work->fallbacks > 0) return false;
    result_.work.add(*work);
    return now ? added_energy(before, bodies_, closed_) <= kClosingRounding * kinetic_energy(before) : true;
  }
  /// Adapts a row of the whole interval to the rest of the interval or, with `now`, to an impact at the
  /// current time. Forces and torques are constant over the interval. In an impact, motors and friction of
  /// limited strength, soft motors and dampers have no effect. A motor of unlimited strength keeps its speed.
  void set_row(BoundedRow& row, bool now) const {
    const Real rest = 1 - time_ / problem_.duration;
    row.impulse *= now ? 0 : rest;
    row.lower *= rest;
    row.upper *= rest;
    row.softness /= rest;
    if (row.lag != 0) row.target -= row.lag * (row_speed(row, now_) - row_speed(row, problem_.start));
    if (!now) return;
    if (row.softness > 0 || std::isfinite(row.lower)) row.lower = row.upper = 0;
    row.target = row_speed(row, bodies_);
  }
  /// Adds the fraction `part` of the impulses of the last solution to the result.
  void add_impulses(Real part) {
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      result_.contacts[rows_[k]].impulse += part * closed_[k].impulse;
      result_.contacts[rows_[k]].moment += part * closed_[k].moment;
    }
    for (std::size_t k = 0; k < bounded_.size(); ++k)
      result_.bounded[k].impulse += part * bounded_[k].impulse;
    for (std::size_t k = 0; k < reactions_.size(); ++k) result_.constraints[k] += part * reactions_[k];
  }
  /// Solves the closed contacts and the joints from the current time to the end of the interval.
  bool solve_rest() {
    const Real part = 1 - time_ / problem_.duration;
    bodies_ = now_;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      bodies_[i].velocity += part * (problem_.free[i].velocity - problem_.start[i].velocity);
      bodies_[i].angular_velocity +=
          part * (problem_.free[i].angular_velocity - problem_.start[i].angular_velocity);
    }
    if (!solve_closed(false)) return false;
    for (std::size_t k = 0; k < rows_.size(); ++k) guesses_[rows_[k]] = closed_[k].impulse / part;
    return true;
  }
  Real speed(uint32_t i, std::span<const ContactBody> bodies) const {
    const Contact& c = problem_.contacts[i];
    return c.frame.n.dot(bodies[c.a].velocity_at(c.arm_a) - bodies[c.b].velocity_at(c.arm_b)) +
           problem_.points[i].surface.x();
  }
  /// Returns the time until the next contact closes [s]. If no contact closes, this time is beyond the end of
  /// the interval.
  Real next_closing() {
    const Real rest = problem_.duration - time_;
    Real next = 2 * rest;
    for (uint32_t i = 0; i < gaps_.size(); ++i) {
      if (!open_[i]) continue;
      closing_[i] = closing_time(gaps_[i], speed(i, now_), speed(i, bodies_), rest);
      next = std::min(next, closing_[i]);
    }
    return next;
  }
  /// Advances the state by `duration` [s]. The velocities change at a constant rate towards the velocities in
  /// bodies_.
  void advance(Real duration) {
    const Real part = duration / (problem_.duration - time_);
    add_impulses(part);
    std::vector<ContactBody> next = now_;
    for (std::size_t i = 0; i < now_.size(); ++i) {
      next[i].velocity += part * (bodies_[i].velocity - now_[i].velocity);
      next[i].angular_velocity += part * (bodies_[i].angular_velocity - now_[i].angular_velocity);
      Displacement& d = result_.displacements[i];
      d.shift += duration / 2 * (now_[i].velocity + next[i].velocity);
      d.turn += duration / 2 * (now_[i].angular_velocity + next[i].angular_velocity);
    }
    for (uint32_t i = 0; i < gaps_.size(); ++i) {
      const Real change = duration / 2 * (speed(i, now_) + speed(i, next));
      if (!open_[i]) {
        // A closed contact without force may have a gap when it opens.
        gaps_[i] = std::max(0.0, gaps_[i] + change);
        continue;
      }
      gaps_[i] += change;
      if (gaps_[i] > kClosed && closing_[i] > duration + kTogether * problem_.duration) continue;
      gaps_[i] = 0;
      open_[i] = false;
    }
    now_ = std::move(next);
    time_ += duration;
  }
  /// Stops the approach of the closed contacts.
  bool close() {
    const Real elapsed = time_ / problem_.duration;
    bool approaches = false;
    for (uint32_t i = 0; i < gaps_.size(); ++i)
      approaches =
          approaches || (!open_[i] && speed(i, now_) + problem_.points[i].bias_at(elapsed).x() < -kStopped);
    if (!approaches) return true;
    bodies_ = now_;
    if (!solve_closed(true)) return false;
    add_impulses(1);
    now_ = bodies_;
    return true;
  }

  /// Opens the closed contacts whose surfaces separate at the current time. If they counted as closed, their
  /// forces would keep the surfaces from approaching at the end of the interval while the surfaces move
  /// apart, and would add energy: a box on its four corners would rock for ever.
  void open() {
    const Real elapsed = time_ / problem_.duration;
    for (uint32_t i = 0; i < gaps_.size(); ++i) {
      if (open_[i]) continue;
      const ClosingPoint& point = problem_.points[i];
      const Real turning = std::abs(point.bias_at(1).x() - point.bias_at(0).x());
      open_[i] = speed(i, now_) + point.bias_at(elapsed).x() > kOpening + kTurningShare * turning;
      if (!open_[i]) gaps_[i] = 0;
    }
  }

  const ClosingProblem& problem_;
  ProximalNewton& newton_;
  ClosingSolution result_;
  Real time_ = 0, cost_ = 0;
  /// By contact: whether it is open; the current gap [m]; the time until it closes [s].
  std::vector<uint8_t> open_;
  std::vector<Real> gaps_, closing_;
  /// By contact: the impulse over the whole interval.
  std::vector<Vec3> guesses_;
  /// The velocities at the current time, and at the end of the interval.
  std::vector<ContactBody> now_, bodies_;
  /// The contacts of the last solution; rows_ has the index of each in the problem.
  std::vector<Contact> closed_;
  std::vector<uint32_t> rows_;
  std::vector<BoundedRow> bounded_;
  std::vector<Vec6> reactions_;
};

}  // namespace

std::optional<ClosingSolution> solve_closing(const ClosingProblem& problem, ProximalNewton& newton,
                                             Real& cost) {
  Pieces pieces(problem, newton);
  std::optional<ClosingSolution> solution = pieces.solve();
  cost = pieces.cost();
  return solution;
}

}  // namespace offstage::sim
