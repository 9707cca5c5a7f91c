#include "sim/articulation/joint_limits.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace offstage::sim {
namespace {

constexpr Real kInfinite = std::numeric_limits<Real>::infinity();
/// kPushOut: fraction of the violation of a limit that a step removes. kFastestPush: greatest speed of this
/// correction [rad/s], [m/s].
constexpr Real kPushOut = 0.2, kFastestPush = 2;
/// A limit whose distance from the coordinate is at most kNear has a row. A limit within kReached takes part
/// in collisions [rad], [m].
constexpr Real kNear = 0.02, kReached = 1e-4;
/// A limit within this distance is reached if its impact was traced back to the current time [rad], [m].
constexpr Real kTraced = 1e-3;
/// Greatest number of rebounds at one time, and of bisections for this time.
constexpr int kMostAtOnce = 8, kBisections = 50;
/// Links that turn by more than this in an interval are not predicted [rad].
constexpr Real kMostTurn = 1;
/// A joint that approaches its limit faster than this speed reaches the limit in the interval [m/s], [rad/s].
constexpr Real kClosing = 1e-3;
/// Fraction of an interval over which the rate of a motor's target is measured.
constexpr Real kRatePart = 1e-3;
/// The path of a motor's target is smooth in an interval if its mean rate differs from the mean of the rates
/// at both ends by at most this fraction of their difference.
constexpr Real kUneven = 0.1;

/// Slots of Joint::efforts.
enum Slot : std::size_t { kLimit = 0, kSwing = 1, kMotor = 2, kFriction = 3, kDamping = 6, kSpring = 9 };

/// A direction of a joint at the interval's start and end, and at the time for which the impulses are placed
/// (`acting`).
struct Direction {
  JointRow start, acting, end;
};

/// Makes the rows of one joint.
class RowMaker {
 public:
  RowMaker(const Articulation& articulation, std::size_t j, Real duration, Real time)
      : joint_(*articulation.joints()[j]),
        is_kicked_(articulation.has_springs()),
        is_traced_(articulation.traces_rebounds() && joint_.def.restitution > 0 &&
                   joint_.def.motor.mode == Motor::Mode::none),  // a motor would drive the joint on
        def_(joint_.def),
        h_(duration),
        time_(time),
        start_(articulation.start_place(j, time - duration, start_a_, start_b_)),
        acting_(articulation.joint_place(j, time, still_a_, still_b_)),
        end_(articulation.end_place(j, time, end_a_, end_b_)) {}

  /// `articulation`: the one that was given to the constructor.
  void add_all(Articulation& articulation, std::vector<BoundedRow>& rows,
               std::vector<BoundedOrigin>& origins) {
    rows_ = &rows;
    origins_ = &origins;
    if (def_.has_free_coordinate()) {
      add_range(free(), kLimit, def_.lower, def_.upper);
      add_motor(articulation, free());
    }
    if (def_.swing < kInfinite) {
      add_range(swing(), kSwing, least_swing(), def_.swing);
    }
    if (def_.friction > 0 || def_.damping > 0) add_resistance();
  }

  void add_stops(std::vector<BoundedRow>& rows, std::vector<BoundedOrigin>& origins) {
    rows_ = &rows;
    origins_ = &origins;
    if (def_.has_free_coordinate()) add_stop(free(), kLimit, def_.lower, def_.upper);
    if (def_.swing < kInfinite) add_stop(swing(), kSwing, least_swing(), def_.swing);
  }

  void add_spring(std::vector<BoundedRow>& rows, std::vector<BoundedOrigin>& origins) {
    rows_ = &rows;
    origins_ = &origins;
    for (std::size_t i = 0; i < 3; ++i) add_guessed(spring_row(i), kSpring + i, 0);
  }

  /// Returns the first impact at a limit; see first_stop() in the header.
  std::optional<Real> first_stop() const {
    std::optional<Real> first;
    const auto look = [&](const Direction& row, Real lower, Real upper) {
      if (lower == upper) return;
      for (const auto& [limit, side] : {std::pair(lower, 1), std::pair(upper, -1)})
        if (const auto at = stop(row, limit, side)) first = std::min(first.value_or(1), at->fraction);
    };
    if (def_.has_free_coordinate()) look(free(), def_.lower, def_.upper);
    if (def_.swing < kInfinite) look(swing(), least_swing(), def_.swing);
    return first;
  }

  /// Returns the first impact with a rebound; see first_rebound() in the header.
  std::optional<Real> first_rebound() const {
    std::optional<Real> first;
    for_each_limit([&](const Direction& row, Real limit, int side) {
      if (const auto at = rebound_time(row, limit, side)) first = std::min(first.value_or(1), *at);
    });
    return first;
  }

  /// Lets the joint rebound from a limit that it has reached. Returns whether it does so.
  bool rebound(Articulation& articulation) {
    bool any = false;
    for_each_limit([&](const Direction& row, Real limit, int side) {
      const Real speed_now = speed(row), mobility = articulation.mobility(joint_, row.end);
      if (any || side * (row.end.error - limit) > kTraced || !bounces(side * speed_now) || !(mobility > 0))
        return;
      articulation.strike(joint_, row.end, end_.arm_a, -(1 + def_.restitution) * speed_now / mobility);
      any = true;
    });
    return any;
  }

 private:
  /// Calls look(row, limit, side) for each limit that is traced. `side`: see stop().
  template <class Look>
  void for_each_limit(Look&& look) const {
    if (!is_traced_) return;
    const auto both = [&](const Direction& row, Real lower, Real upper) {
      if (lower == upper) return;
      look(row, lower, 1);
      look(row, upper, -1);
    };
    if (def_.has_free_coordinate()) both(free(), def_.lower, def_.upper);
    if (def_.swing < kInfinite) both(swing(), least_swing(), def_.swing);
  }
  static bool bounces(Real speed) { return speed < -JointDef::kBounceSpeed; }

  /// Returns the fraction of the interval before an impact with a rebound, or nothing if there is none. The
  /// path of the coordinate is the cubic with the coordinates and the speeds of both ends.
  std::optional<Real> rebound_time(const Direction& row, Real limit, int side) const {
    const Real gap = side * (row.start.error - limit), left = side * (row.end.error - limit);
    if (!(left < 0) || gap < -kTraced) return std::nullopt;
    const Real before = side * speed_at_start(row), after = side * speed(row);
    if (!bounces(before + std::max(gap, 0.0) / (std::max(gap, 0.0) - left) * (after - before)))
      return std::nullopt;
    Real low = 0, high = 1;
    for (int k = 0; k < kBisections && gap > 0; ++k) {
      const Real s = (low + high) / 2, r = 1 - s;
      const Real at =
          r * r * ((1 + 2 * s) * gap + s * h_ * before) + s * s * ((3 - 2 * s) * left - r * h_ * after);
      (at > 0 ? low : high) = s;
    }
    return gap > 0 ? high : 0;
  }

  /// Whether a limit has no row in this interval because its impact is traced back to its time. A limit that
  /// the joint only approaches has none either, since it would slow the joint down before.
  bool awaits_rebound(const Direction& row, Real limit, int side) const {
    if (!is_traced_) return false;
    const bool approaches = side * (row.start.error - limit) > -kTraced &&
                            bounces(side * speed_at_start(row)) && bounces(side * speed(row));
    return approaches || rebound_time(row, limit, side).has_value();
  }

  Real least_swing() const { return def_.type == JointType::universal ? -def_.swing : -kInfinite; }

  /// Returns the free coordinate of the joint, which counts whole turns.
  Direction free() const {
    const auto row = [&](const JointPlace& place) { return free_row(def_, place, joint_.length); };
    Direction d{row(start_), row(acting_), row(end_)};
    if (!counts_turns(joint_)) return d;
    constexpr Real kTurn = 2 * std::numbers::pi;
    for (JointRow* r : {&d.start, &d.end})
      r->error += kTurn * std::round((joint_.coordinate - r->error) / kTurn);
    return d;
  }
  Direction swing() const {
    return {swing_row(def_.type, start_), swing_row(def_.type, acting_), swing_row(def_.type, end_)};
  }
  Direction turning(Eigen::Index axis) const {
    const auto row = [axis](const JointPlace& place) { return turning_row(place.axes_b.col(axis)); };
    return {row(start_), row(acting_), row(end_)};
  }

  BoundedRow bounded(const Direction& d) const {
    const JointRow& row = d.acting;
    BoundedRow r{.on_a = row.on_a, .on_b = row.on_b};
    const auto end = [&](const Body* body, const LinkMotion& motion, const Vec6& on, uint32_t& index) {
      if (body && body->is_dynamic()) {
        index = body->row;
      } else {
        r.offset += on.head<3>().dot(motion.velocity) + on.tail<3>().dot(motion.angular_velocity);
      }
    };
    end(joint_.a, acting_.a, row.on_a, r.a);
    end(joint_.b, acting_.b, row.on_b, r.b);
    return r;
  }

  /// Returns a row that also contains the change of speed because the direction turns within the interval. It
  /// is used for limits and for all rows of distance joints. Without it, the speed along a rope at the end of
  /// the interval would contain a part of the speed across it, and a winch would damp a load that swings. For
  /// other motors, no case is known in which this change improves the accuracy. With this change in its
  /// motors, the gripper of demos/scenes/robot_arm.json diverged, because the exact solver often leaves the
  /// contacts of the gripper to the fall-back.
  BoundedRow turning_with(const Direction& d) const {
    BoundedRow r = bounded(d);
    const auto turn = [&](const LinkMotion& motion) { return h_ * motion.angular_velocity.norm(); };
    if (std::max(turn(end_.a), turn(end_.b)) > kMostTurn) return r;
    const Real at_end = speed(d.end, end_) - speed(d.acting, end_);
    r.offset += at_end;
    r.turning = speed(d.start, start_) - speed(d.acting, start_) - at_end;
    return r;
  }

  /// Returns the row of a motor, of friction or of a damper.
  BoundedRow driven(const Direction& d) const {
    return def_.type == JointType::distance ? turning_with(d) : bounded(d);
  }

  static Real speed(const JointRow& row, const JointPlace& at) {
    return row.on_a.head<3>().dot(at.a.velocity) + row.on_a.tail<3>().dot(at.a.angular_velocity) +
           row.on_b.head<3>().dot(at.b.velocity) + row.on_b.tail<3>().dot(at.b.angular_velocity);
  }
  /// Returns the speed of the coordinate at the interval's end, before the impulses of the rows are applied.
  Real speed(const Direction& d) const { return speed(d.end, end_); }

  /// Returns the coordinate at the interval's end minus the mean of the speeds at both ends times the
  /// duration, all without the impulses of the rows. A row whose target speed is computed from this
  /// coordinate reaches the wanted coordinate exactly. For links with springs the speed at the end replaces
  /// the mean.
  Real at_start(const Direction& d) const {
    return d.end.error - h_ / 2 * ((is_kicked_ ? speed(d) : speed_at_start(d)) + speed(d));
  }
  Real speed_at_start(const Direction& d) const { return speed(d.start, start_); }

  void add(const BoundedRow& row, std::size_t slot, Real end_weight) {
    rows_->push_back(row);
    origins_->push_back({&joint_, slot, acting_.arm_a, end_weight});
  }
  void add_guessed(BoundedRow row, std::size_t slot, Real end_weight) {
    row.impulse = std::clamp(h_ * joint_.efforts[slot], row.lower, row.upper);
    add(row, slot, end_weight);
  }

  /// An impact at a limit that the free motion reaches in this interval.
  struct Stop {
    Real fraction;  ///< fraction of the interval before the impact
    Real target;    ///< speed away from the limit at the interval's end
  };
  /// Returns the impact at a limit, or nothing if there is none in the interval. The impact reverses the
  /// speed of the coordinate and multiplies it by the restitution. In the rest of the interval the
  /// acceleration of the free motion acts. A joint without restitution stays at its limit. `side`: 1 for a
  /// lower limit, -1 for an upper limit.
  std::optional<Stop> stop(const Direction& row, Real limit, int side) const {
    const Real gap = side * (row.start.error - limit), left = side * (row.end.error - limit);
    if (!(left < 0) || gap < 0) return std::nullopt;
    const Real before = side * speed_at_start(row), after = side * speed(row), fraction = gap / (gap - left);
    const Real impact = before + fraction * (after - before);
    const Real restitution = bounces(impact) ? def_.restitution : 0;
    if (is_traced_ && restitution > 0) return std::nullopt;
    // A joint that rests at its limit still approaches it, by the speed that the forces of an interval cause.
    if (restitution == 0 && !(impact < -std::max(kClosing, std::abs(after - before)))) return std::nullopt;
    return Stop{fraction, std::max(0.0, (1 - fraction) * (after - before) - restitution * impact)};
  }

  bool add_stop_within(const Direction& row, std::size_t slot, Real limit, int side) {
    const std::optional<Stop> at = stop(row, limit, side);
    if (!at) return false;
    BoundedRow r = bounded(row);
    r.lower = side > 0 ? 0 : -kInfinite;
    r.upper = side > 0 ? kInfinite : 0;
    r.target = side * at->target;
    r.from = at->fraction;
    add(r, slot, 0);
    return true;
  }

  /// Adds a row for the nearer of the two limits. If both limits are equal, the row fixes the coordinate.
  void add_range(const Direction& row, std::size_t slot, Real lower, Real upper) {
    if (lower < upper && (awaits_rebound(row, lower, 1) || awaits_rebound(row, upper, -1))) {
      joint_.efforts[slot] = 0;
      return;
    }
    if (!is_kicked_ && lower < upper &&
        (add_stop_within(row, slot, lower, 1) || add_stop_within(row, slot, upper, -1)))
      return;
    const Real reach = kNear + 2 * h_ * std::abs(speed(row));
    const Real below = row.end.error - lower, above = upper - row.end.error;
    if (std::min(below, above) > reach) {
      joint_.efforts[slot] = 0;
      return;
    }
    const bool is_low = below <= above;
    const Real side = is_low ? 1 : -1, limit = is_low ? lower : upper;
    // A constant force throughout the interval holds a joint that rests at its limit or leaves it.
    const bool closes = is_kicked_ || side * speed_at_start(row) <
                                          -std::max(kClosing, std::abs(speed(row) - speed_at_start(row)));
    const Real gap = side * ((closes ? at_start(row) : row.start.error) - limit);
    BoundedRow r = turning_with(row);
    r.lower = lower == upper || !is_low ? -kInfinite : 0;
    r.upper = lower == upper || is_low ? kInfinite : 0;
    r.target = -side * (gap > 0 ? gap / h_ : std::max(gap * kPushOut / h_, -kFastestPush));
    // Links with springs move by the speed of the end, so they rebound before they reach the limit.
    const Real approach = -side * speed_at_start(row);
    if (is_kicked_ && approach > JointDef::kBounceSpeed && side * (row.end.error - limit) < 0)
      r.target = side * std::max(side * r.target, def_.restitution * approach);
    add_guessed(r, slot, closes ? 1 : 0);
  }

  /// Returns the speed at the end that lets a position motor follow its moving target by a constant force, or
  /// nothing if the joint is not on the target's path or the path is not smooth in the interval. With the
  /// deviations X and U from the target's position and speed, the bodies move by X' = X + h (U + U') / 2.
  /// U' = -X / h - U / 2 ends any small deviation in two intervals. If bodies moved by the speed at the end
  /// instead, others that they carry would slip back by the acceleration times h^2 / 2 in each interval.
  std::optional<Real> speed_on_track(const Direction& row) const {
    if (is_kicked_) return std::nullopt;
    const Motor& motor = def_.motor;
    const Real before = time_ - h_, part = kRatePart * h_;
    const Real first = motor.target(before), last = motor.target(time_);
    const Real first_rate = (motor.target(before + part) - first) / part;
    const Real last_rate = (last - motor.target(time_ - part)) / part;
    const Real change = std::abs(last_rate - first_rate);
    if (std::abs((last - first) / h_ - (first_rate + last_rate) / 2) > kUneven * change + kClosing)
      return std::nullopt;
    const Real behind = (at_start(row) - first) / h_, slow = speed_at_start(row) - first_rate;
    if (std::max(std::abs(behind), std::abs(slow)) > change + kClosing) return std::nullopt;
    return last_rate - behind - slow / 2;
  }

  /// Returns the weight of the end's speed in the mean speed of a soft motor's interval, 1/2 to 1.
  /// With the weight theta the interval is integrated by the theta method, x' = x + h v and
  /// effort = k (target - x - theta (x' - x)) - c v with v = (1 - theta) u + theta u'. 1/2 is of second order
  /// and keeps the energy of the spring. A part of the motion that changes at the rate s then follows the
  /// factor (1 - (1 - theta) s h) / (1 + theta s h) per interval. For a large s h and 1/2 this is about -1: a
  /// stiff motor would vibrate for ever. (1 - theta) s h <= 1 prevents it for a damper, s = c / m. For a
  /// spring, s = 2 sqrt(k / m): with its critical damping both rates agree.
  Real soft_end_weight(Articulation& articulation, const Direction& row) const {
    if (is_kicked_) return 1;  // Links with springs move by the velocities at the end.
    const Real mobility = articulation.mobility(joint_, row.acting);
    const Motor& motor = def_.motor;
    const Real rate = std::max(2 * std::sqrt(motor.stiffness * mobility), motor.damping * mobility);
    return 1 - std::min(0.5, 1 / (rate * h_));
  }

  /// Adds the row of a motor without a stiffness. `end_weight`: see BoundedOrigin. A limit is a stop for a
  /// motor of unlimited effort, too, although the rows of both contradict each other: the motor moves the
  /// joint up to the limit and holds it there.
  void add_rigid_motor(const Direction& row, BoundedRow r, Real end_weight) {
    if (def_.has_limits() && std::isinf(def_.motor.max_effort)) {
      const Real end = end_weight == 1 || is_kicked_
                           ? at_start(row) + h_ * r.target
                           : row.start.error + h_ / 2 * (speed_at_start(row) + r.target);
      if (const Real within = std::clamp(end, def_.lower, def_.upper); within != end) {
        r.target = (within - at_start(row)) / h_;
        r.turning = driven(row).turning;
        end_weight = std::abs(speed_at_start(row) - r.target) > kClosing ? 1 : 0;
      }
    }
    add_guessed(r, kMotor, end_weight);
  }

  void add_motor(Articulation& articulation, const Direction& row) {
    const Motor& motor = def_.motor;
    if (motor.mode == Motor::Mode::none) return;
    BoundedRow r = driven(row);
    r.upper = h_ * motor.max_effort;
    r.lower = -r.upper;
    const Real target = motor.target(time_);
    if (motor.mode == Motor::Mode::speed) {
      r.target = target;
      // The motor's force is constant in the interval. If the fast solver reached the target in its first
      // sub-step, bodies that the motor carries would slip back by the acceleration times h^2 / 2.
      r.turning += target - speed_at_start(row);
      return add_rigid_motor(row, r, 0);
    }
    const auto if_it_moves = [&](Real end_weight) {
      return std::abs(speed_at_start(row) - r.target) > kClosing ? end_weight : 0;
    };
    if (motor.stiffness == 0) {
      if (const std::optional<Real> speed = speed_on_track(row)) {
        r.target = *speed;
        r.turning += r.target - speed_at_start(row);
        return add_rigid_motor(row, r, 0);
      }
      r.target = (target - at_start(row)) / h_;
      return add_rigid_motor(row, r, if_it_moves(1));
    }
    const Real end = soft_end_weight(articulation, row), start = 1 - end;
    const Real missing = start * motor.target(time_ - h_) + end * target - at_start(row);
    // effort = k (missing - end h v) - c v with v = start * speed at the start + end * speed at the end.
    const Real resistance = motor.stiffness * end * h_ + motor.damping;
    r.softness = 1 / (end * h_ * resistance);
    r.target = (motor.stiffness * missing / resistance - start * speed_at_start(row)) / end;
    r.lag = start / end;
    // With the effort of the last interval the speed hardly changes if the motor holds a load: a load that
    // swings on an elastic rope then moves by the mean of its velocities.
    const Real reached = r.target - r.softness * h_ * joint_.efforts[kMotor];
    const bool moves = std::abs(speed_at_start(row) - reached) > kClosing;
    add_guessed(r, kMotor, moves ? end - start : 0);
  }

  /// Adds rows for the friction and the damping of all free directions.
  void add_resistance() {
    std::vector<Direction> free_directions;
    switch (def_.type) {
      case JointType::fixed:
        return;
      case JointType::spherical:
        for (int i = 0; i < 3; ++i) free_directions.push_back(turning(i));
        break;
      case JointType::universal:
        free_directions = {free(), swing()};
        break;
      default:
        free_directions = {free()};
    }
    for (std::size_t i = 0; i < free_directions.size(); ++i) {
      BoundedRow r = driven(free_directions[i]);
      if (def_.friction > 0) {
        r.upper = h_ * def_.friction;
        r.lower = -r.upper;
        add_guessed(r, kFriction + i, 0);
      }
      if (def_.damping > 0 && !joint_.has_spring()) {
        r.upper = kInfinite;
        r.lower = -kInfinite;
        r.softness = 1 / (h_ * def_.damping);
        add_guessed(r, kDamping + i, 0);
      }
    }
  }

  /// Returns the row of a spring and its damper about an axis. In the free motion, their torque changes by h
  /// (h k + c) times the change of the speed.
  BoundedRow spring_row(std::size_t axis) const {
    const Direction row = turning(static_cast<Eigen::Index>(axis));
    BoundedRow r = bounded(row);
    r.lower = -kInfinite;
    r.upper = kInfinite;
    r.softness = 1 / (h_ * def_.resistance(h_));
    r.target = speed(row.acting, acting_);
    r.resists_change = true;
    return r;
  }

  void add_stop(const Direction& row, std::size_t slot, Real lower, Real upper) {
    BoundedRow r = bounded(row);
    if (row.end.error - lower < kReached)
      r.upper = kInfinite;
    else if (upper - row.end.error < kReached)
      r.lower = -kInfinite;
    else
      return;
    add(r, slot, false);
  }

  Joint& joint_;
  bool is_kicked_, is_traced_;
  const JointDef& def_;
  Real h_, time_;
  LinkMotion start_a_, start_b_, still_a_, still_b_, end_a_, end_b_;
  JointPlace start_, acting_, end_;
  std::vector<BoundedRow>* rows_ = nullptr;
  std::vector<BoundedOrigin>* origins_ = nullptr;
};

}  // namespace

std::optional<Real> first_stop(const Articulation& articulation, Real duration, Real time) {
  std::optional<Real> first;
  for (std::size_t j = 0; j < articulation.joints().size(); ++j)
    if (const JointDef& def = articulation.joints()[j]->def; def.has_limits() || def.swing < kInfinite)
      if (const auto at = RowMaker(articulation, j, duration, time).first_stop())
        first = std::min(first.value_or(1), *at);
  return first;
}

std::optional<Real> first_rebound(const Articulation& articulation, Real duration, Real time) {
  std::optional<Real> first;
  for (std::size_t j = 0; j < articulation.joints().size(); ++j)
    if (articulation.joints()[j]->def.restitution > 0)
      if (const auto at = RowMaker(articulation, j, duration, time).first_rebound())
        first = std::min(first.value_or(1), *at);
  return first;
}

void rebound(Articulation& articulation, Real time) {
  // A rebound may send another joint against its limit.
  bool any = true;
  for (int k = 0; any && k < kMostAtOnce; ++k) {
    any = false;
    articulation.place(time, true);
    for (std::size_t j = 0; !any && j < articulation.joints().size(); ++j)
      any = articulation.joints()[j]->def.restitution > 0 &&
            RowMaker(articulation, j, 1, time).rebound(articulation);
  }
}

void collect_bounded_rows(Articulation& articulation, Real duration, Real time, std::vector<BoundedRow>& rows,
                          std::vector<BoundedOrigin>& origins) {
  if (!articulation.has_bounded_rows()) return;
  for (std::size_t j = 0; j < articulation.joints().size(); ++j)
    if (articulation.joints()[j]->has_bounded_rows())
      RowMaker(articulation, j, duration, time).add_all(articulation, rows, origins);
}

void collect_springs(const Articulation& articulation, Real duration, Real time,
                     std::vector<BoundedRow>& rows, std::vector<BoundedOrigin>& origins) {
  if (!articulation.has_springs()) return;
  for (std::size_t j = 0; j < articulation.joints().size(); ++j)
    if (articulation.joints()[j]->has_spring())
      RowMaker(articulation, j, duration, time).add_spring(rows, origins);
}

void collect_stops(const Articulation& articulation, Real time, std::vector<BoundedRow>& rows,
                   std::vector<BoundedOrigin>& origins) {
  if (!articulation.has_bounded_rows()) return;
  for (std::size_t j = 0; j < articulation.joints().size(); ++j)
    if (articulation.joints()[j]->has_bounded_rows())
      RowMaker(articulation, j, 1, time).add_stops(rows, origins);
}

}  // namespace offstage::sim
