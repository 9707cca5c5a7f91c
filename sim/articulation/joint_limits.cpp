#include "sim/articulation/joint_limits.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace offstage::sim {
namespace {

constexpr Real kInfinite = std::numeric_limits<Real>::infinity();
/// Share of the violation of a limit that a step removes, and the greatest speed of the removal [rad/s],
/// [m/s].
constexpr Real kPushOut = 0.2, kFastestPush = 2;
/// A limit within kNear of the coordinate has a row; limits within kReached take part in collisions [rad],
/// [m].
constexpr Real kNear = 0.02, kReached = 1e-4;

/// Slots of Joint::efforts.
enum Slot : std::size_t { kLimit = 0, kSwing = 1, kMotor = 2, kFriction = 3, kDamping = 6, kSpring = 9 };

/// Makes the rows of one joint.
class RowMaker {
 public:
  RowMaker(const Articulation& articulation, std::size_t j, Real duration, Real time)
      : joint_(*articulation.joints()[j]),
        def_(joint_.def),
        h_(duration),
        time_(time),
        place_(articulation.joint_place(j, time, still_a_, still_b_)) {}

  void add_all(std::vector<BoundedRow>& rows, std::vector<BoundedOrigin>& origins) {
    rows_ = &rows;
    origins_ = &origins;
    if (def_.has_free_coordinate()) {
      add_range(free(), kLimit, def_.lower, def_.upper);
      add_motor(free());
    }
    if (def_.swing < kInfinite) {
      const JointRow swing = swing_row(def_.type, place_);
      add_range(swing, kSwing, def_.type == JointType::universal ? -def_.swing : -kInfinite, def_.swing);
    }
    if (def_.friction > 0 || def_.damping > 0) add_resistance();
    if (def_.stiffness > 0) add_spring();
  }

  void add_stops(std::vector<BoundedRow>& rows, std::vector<BoundedOrigin>& origins) {
    rows_ = &rows;
    origins_ = &origins;
    if (def_.has_free_coordinate()) add_stop(free(), kLimit, def_.lower, def_.upper);
    if (def_.swing < kInfinite)
      add_stop(swing_row(def_.type, place_), kSwing,
               def_.type == JointType::universal ? -def_.swing : -kInfinite, def_.swing);
  }

 private:
  /// The free coordinate including whole turns.
  JointRow free() const {
    JointRow row = free_row(def_, place_, joint_.length);
    if (!counts_turns(joint_)) return row;
    constexpr Real kTurn = 2 * std::numbers::pi;
    row.error += kTurn * std::round((joint_.coordinate - row.error) / kTurn);
    return row;
  }

  BoundedRow bounded(const JointRow& row) const {
    BoundedRow r{.on_a = row.on_a, .on_b = row.on_b};
    const auto end = [&](const Body* body, const LinkMotion& motion, const Vec6& on, uint32_t& index) {
      if (body && body->is_dynamic()) {
        index = body->row;
      } else {
        r.offset += on.head<3>().dot(motion.velocity) + on.tail<3>().dot(motion.angular_velocity);
      }
    };
    end(joint_.a, place_.a, row.on_a, r.a);
    end(joint_.b, place_.b, row.on_b, r.b);
    return r;
  }

  Real speed(const JointRow& row) const {
    return row.on_a.head<3>().dot(place_.a.velocity) + row.on_a.tail<3>().dot(place_.a.angular_velocity) +
           row.on_b.head<3>().dot(place_.b.velocity) + row.on_b.tail<3>().dot(place_.b.angular_velocity);
  }

  /// The coordinate at the interval's start, by the mean of the speeds at both ends, without the effect of
  /// the rows.
  Real at_start(const JointRow& row) const {
    Real sum = speed(row);
    const auto add_end = [&](const Body* body, const LinkMotion& motion, const Vec6& on) {
      const Twist& t =
          body && body->is_dynamic() ? body->start_twist : Twist{motion.velocity, motion.angular_velocity};
      sum += on.head<3>().dot(t.velocity) + on.tail<3>().dot(t.angular_velocity);
    };
    add_end(joint_.a, place_.a, row.on_a);
    add_end(joint_.b, place_.b, row.on_b);
    return row.error - h_ / 2 * sum;
  }
  Real speed_at_start(const JointRow& row) const { return 2 * (row.error - at_start(row)) / h_ - speed(row); }

  void add(const BoundedRow& row, std::size_t slot, bool is_stop) {
    rows_->push_back(row);
    origins_->push_back({&joint_, slot, place_.arm_a, is_stop});
  }
  void add_guessed(BoundedRow row, std::size_t slot, bool is_stop) {
    row.impulse = std::clamp(h_ * joint_.efforts[slot], row.lower, row.upper);
    add(row, slot, is_stop);
  }

  /// Adds the impact at a limit that the coordinate reaches in this interval: the speed where it meets the
  /// limit is reversed, and the acceleration of the free motion acts in the rest of the interval. `side` is 1
  /// for a lower limit and -1 for an upper one. Returns false if it does not meet the limit fast enough.
  bool add_bounce(const JointRow& row, std::size_t slot, Real limit, int side) {
    const Real gap = side * (at_start(row) - limit), left = side * (row.error - limit);
    if (!(def_.restitution > 0) || !(left < 0) || gap < 0) return false;
    const Real before = side * speed_at_start(row), after = side * speed(row), share = gap / (gap - left);
    const Real impact = before + share * (after - before);
    if (!(impact < -JointDef::kBounceSpeed)) return false;
    BoundedRow r = bounded(row);
    r.lower = side > 0 ? 0 : -kInfinite;
    r.upper = side > 0 ? kInfinite : 0;
    r.target = side * (-def_.restitution * impact + (1 - share) * (after - before));
    add(r, slot, false);
    return true;
  }

  /// Adds a row for the nearer of both limits. If they are equal, the coordinate is held.
  void add_range(const JointRow& row, std::size_t slot, Real lower, Real upper) {
    if (slot == kLimit && lower < upper &&
        (add_bounce(row, slot, lower, 1) || add_bounce(row, slot, upper, -1)))
      return;
    const Real u = speed(row), start = at_start(row);
    const Real reach = kNear + 2 * h_ * std::abs(u);
    BoundedRow r = bounded(row);
    const auto towards = [&](Real gap) {
      return gap > 0 ? gap / h_ : std::max(gap * kPushOut / h_, -kFastestPush);
    };
    const Real below = row.error - lower, above = upper - row.error;
    if (std::min(below, above) > reach) {
      joint_.efforts[slot] = 0;
      return;
    }
    r.lower = lower == upper || above < below ? -kInfinite : 0;
    r.upper = lower == upper || below <= above ? kInfinite : 0;
    r.target = below <= above ? -towards(start - lower) : towards(upper - start);
    add_guessed(r, slot, true);
  }

  void add_motor(const JointRow& row) {
    const Motor& motor = def_.motor;
    if (motor.mode == Motor::Mode::none) return;
    BoundedRow r = bounded(row);
    r.upper = h_ * motor.max_effort;
    r.lower = -r.upper;
    const Real target = motor.target(time_);
    if (motor.mode == Motor::Mode::speed) {
      r.target = target;
      return add_guessed(r, kMotor, false);
    }
    const Real missing = target - at_start(row);
    if (motor.stiffness == 0) {
      r.target = missing / h_;
    } else {
      // effort = k (missing - h u) - c u, with the speed u at the end.
      const Real resistance = motor.stiffness * h_ + motor.damping;
      r.softness = 1 / (h_ * resistance);
      r.target = motor.stiffness * missing / resistance;
    }
    add_guessed(r, kMotor, true);
  }

  /// Friction and damping of all free directions.
  void add_resistance() {
    std::vector<JointRow> free_directions;
    switch (def_.type) {
      case JointType::fixed:
        return;
      case JointType::spherical:
        for (int i = 0; i < 3; ++i) free_directions.push_back(turning_row(place_.axes_b.col(i)));
        break;
      case JointType::universal:
        free_directions = {free(), swing_row(def_.type, place_)};
        break;
      default:
        free_directions = {free()};
    }
    for (std::size_t i = 0; i < free_directions.size(); ++i) {
      BoundedRow r = bounded(free_directions[i]);
      if (def_.friction > 0) {
        r.upper = h_ * def_.friction;
        r.lower = -r.upper;
        add_guessed(r, kFriction + i, false);
      }
      if (def_.damping > 0) {
        r.upper = kInfinite;
        r.lower = -kInfinite;
        r.softness = 1 / (h_ * def_.damping);
        add_guessed(r, kDamping + i, false);
      }
    }
  }

  /// The torque -k theta of a spherical joint at the interval's end, for the rotation vector theta of a
  /// relative to b.
  void add_spring() {
    const Quat turn(Mat3(place_.axes_b.transpose() * place_.axes_a));
    const Vec3 half = turn.w() < 0 ? Vec3(-turn.vec()) : Vec3(turn.vec());
    const Real sine = half.norm();
    const Vec3 theta =
        sine > 0 ? Vec3(2 * angle_of(sine, std::abs(turn.w())) / sine * half) : Vec3(Vec3::Zero());
    for (int i = 0; i < 3; ++i) {
      JointRow row = turning_row(place_.axes_b.col(i));
      row.error = theta[i];
      BoundedRow r = bounded(row);
      r.lower = -kInfinite;
      r.upper = kInfinite;
      r.softness = 1 / (h_ * h_ * def_.stiffness);
      r.target = -at_start(row) / h_;
      add_guessed(r, kSpring + static_cast<std::size_t>(i), false);
    }
  }

  void add_stop(const JointRow& row, std::size_t slot, Real lower, Real upper) {
    BoundedRow r = bounded(row);
    if (row.error - lower < kReached)
      r.upper = kInfinite;
    else if (upper - row.error < kReached)
      r.lower = -kInfinite;
    else
      return;
    add(r, slot, true);
  }

  Joint& joint_;
  const JointDef& def_;
  Real h_, time_;
  LinkMotion still_a_, still_b_;
  JointPlace place_;
  std::vector<BoundedRow>* rows_ = nullptr;
  std::vector<BoundedOrigin>* origins_ = nullptr;
};

}  // namespace

void collect_bounded_rows(const Articulation& articulation, Real duration, Real time,
                          std::vector<BoundedRow>& rows, std::vector<BoundedOrigin>& origins) {
  if (!articulation.has_bounded_rows()) return;
  for (std::size_t j = 0; j < articulation.joints().size(); ++j)
    if (articulation.joints()[j]->has_bounded_rows())
      RowMaker(articulation, j, duration, time).add_all(rows, origins);
}

void collect_stops(const Articulation& articulation, Real time, std::vector<BoundedRow>& rows,
                   std::vector<BoundedOrigin>& origins) {
  if (!articulation.has_bounded_rows()) return;
  for (std::size_t j = 0; j < articulation.joints().size(); ++j)
    if (articulation.joints()[j]->has_bounded_rows())
      RowMaker(articulation, j, 1, time).add_stops(rows, origins);
}

}  // namespace offstage::sim
