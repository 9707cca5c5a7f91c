#include "sim/world/impact_search.h"

#include <algorithm>
#include <cmath>

#include "sim/collision/time_of_impact.h"
#include "sim/contact/contact_motion.h"
#include "sim/contact/contact_terms.h"
#include "sim/dynamics/free_body.h"

namespace offstage::sim {
namespace {

/// Larger rotations in an interval are divided into at most kMostTurns pieces of this angle [rad].
constexpr Real kImpactTurn = 0.5, kMostTurns = 512;
/// If a body turns by more than this in an interval [rad], the contact forces of the interval's start soon
/// become invalid, and the body is assumed to fly freely.
constexpr Real kFastSpin = 3;

/// A path that deviates from its chord by more than kStraight [m] is divided into at most kMostArcs pieces.
/// The force counts as steady if the position at the end agrees with the mean velocity. The accepted
/// difference is the fraction kSteady of the change of velocity.
constexpr Real kStraight = 1e-5, kMostArcs = 8, kSteady = 0.05;
Real spin(const Body& body) {
  return body.is_awake() ? body.start_twist.angular_velocity.norm() : 0;
}

/// Returns the angular speed of the body of a pair that turns faster [rad/s].
Real turn_of(const ContactPair& pair) {
  return std::max(spin(pair.a()), spin(pair.b()));
}

/// Whether a body may touch at points that are not known at the interval's start. The known points of a rim
/// or of a round side are only those that face the other body at the start.
bool turns_other_points(const Body& body, Real duration) {
  return runs_along(body, duration) ||
         (std::holds_alternative<Ellipsoid>(body.def.shape) && body.turning_speed() * duration > kTouching);
}

/// Returns the number of pieces into which a rotation is divided; one if the rotation is not a number.
uint32_t pieces_of(Real turn) {
  return static_cast<uint32_t>(std::min(std::max(1.0, std::ceil(turn / kImpactTurn)), kMostTurns));
}

/// Returns the change of a body's velocity in its interval, if it is due to a steady force [m/s]. Returns
/// zero if the body was stopped within the interval, which its position at the end shows.
Vec3 bend(const Body& body, Real h) {
  if (!body.is_awake()) return Vec3::Zero();
  const Vec3 change = body.rigid.velocity() - body.start_twist.velocity;
  const Vec3 mean = (body.rigid.position - body.start.position) / (h - body.from);
  const bool steady = (body.start_twist.velocity + change / 2 - mean).norm() < kSteady * change.norm();
  return steady ? change : Vec3(Vec3::Zero());
}

/// Returns the pose at a time of the interval, on the parabola of a steady force.
Pose on_arc(const Body& body, Real time, Real h) {
  Pose pose = body.placed_at(time, h);
  if (time > body.from)
    pose.position -= (time - body.from) * (h - time) / (2 * (h - body.from)) * bend(body, h);
  return pose;
}

/// Returns the time at which two bodies touch, after conservative advancement has ended within its tolerance.
/// The rest of the gap closes at the speed of the nearest points. Without this correction, bounces would be
/// early by the tolerance, and the errors would add up.
Real touching_fraction(const Impact& impact, const PosePath& a, const PosePath& b) {
  const Separation& s = impact.separation;
  if (impact.fraction == 0 || !(s.distance > 0)) return impact.fraction;
  const Pose pose = a.at(impact.fraction);
  const auto velocity = [&](const PosePath& path, const Vec3& local) {
    const Vec3 arm = pose.point_to_world(local) - path.at(impact.fraction).position;
    return Vec3(path.velocity() + path.angular_velocity(impact.fraction).cross(arm));
  };
  const Real closing = (velocity(b, s.on_b) - velocity(a, s.on_a)).dot(pose.vector_to_world(s.normal));
  if (!(closing > 0)) return impact.fraction;
  return impact.fraction + std::min(s.distance / closing, 1 - impact.fraction);
}

/// Follows the free rotation of a body through its interval.
class Tumbling {
 public:
  /// `spins_fast`: the body flies under gravity. Otherwise its position is interpolated on a straight line.
  Tumbling(const Body& body, const WorldDef& def, bool spins_fast, Real h)
      : body_(body), def_(def), spins_fast_(spins_fast), h_(h), turning_(body.at_start()), now_(body.from) {}

  /// Returns the pose at a time of the sub-step of length h, which must not be before the time of the last
  /// call.
  Pose continue_from(Real time) {
    if (!body_.is_awake()) return body_.placed_at(time, h_);
    fly(turning_, {def_.gravity, {}}, integrator(def_.integrator), now_, time - now_, work_);
    now_ = time;
    if (!spins_fast_) {
      const Real fraction = (time - body_.from) / (h_ - body_.from);
      turning_.position = body_.start.position + fraction * (body_.rigid.position - body_.start.position);
    }
    return turning_.pose();
  }

 private:
  const Body& body_;
  const WorldDef& def_;
  bool spins_fast_;
  Real h_;
  RigidBody turning_;
  Real now_;
  IntegratorWorkspace work_;
};

std::optional<Impact> first_impact(const MovingShape& a, const MovingShape& b, const WorldDef& def) {
  return def.collision.impact_time == CollisionMethods::ImpactTime::bisection
             ? bisected_time_of_impact(a, b, kTouching / 2)
             : time_of_impact(a, b, kTouching / 2);
}

/// Returns the time of impact of two bodies that turn far. A path describes at most half a turn, so the
/// motion is divided into pieces.
std::optional<Real> tumbling_impact_time(const ContactPair& pair, const WorldDef& def, Real from, Real h,
                                         Real turn, TestCounts& tests) {
  const bool spins_fast = turn > kFastSpin;
  Tumbling body_a(pair.a(), def, spins_fast, h), body_b(pair.b(), def, spins_fast, h);
  Pose begin_a = body_a.continue_from(from), begin_b = body_b.continue_from(from);
  const uint32_t pieces = pieces_of(turn);
  // Bodies that touch at the start have just collided with each other.
  const bool touches = pair.separation() <= kTouching;
  for (uint32_t i = 0; i < pieces; ++i) {
    const Real begin = from + (h - from) * i / pieces, end = from + (h - from) * (i + 1) / pieces;
    const PosePath path_a(begin_a, body_a.continue_from(end)), path_b(begin_b, body_b.continue_from(end));
    begin_a = path_a.end();
    begin_b = path_b.end();
    const MovingShape a{pair.impact_shape_a(), path_a, &tests}, b{pair.impact_shape_b(), path_b};
    std::optional<Impact> impact;
    const bool met = (i == 0 && touches) || ((impact = first_impact(a, b, def)) && impact->fraction == 0);
    if (met) impact = time_of_next_impact(a, b, kTouching / 2, def.collision_speed * (end - begin));
    if (impact) return begin + impact->fraction * (end - begin);
    // The force of the contact at the start has ended by then, or the contact must be found again.
    if (spins_fast && touches) return end;
  }
  return std::nullopt;
}

/// Returns where a contact feature of a body is [m] when the body has moved from one pose to another. `out`
/// and `out_after` are the directions to the other body in both poses; see turned_arm().
Vec3 moved_point(const Body& body, uint32_t piece, const Pose& from, const Pose& to, const Vec3& point,
                 const Vec3& out, const Vec3& out_after) {
  const Vec3 centre = body.is_awake() ? body.rigid.centre : Vec3(Vec3::Zero());
  return to.point_to_world(centre) + turned_arm(round_surface(body, piece),
                                                point - from.point_to_world(centre), from.orientation, out,
                                                to.orientation, out_after);
}

/// Returns the time at which bodies that already touch at some points touch at their other known points.
std::optional<Real> point_impact_time(const ContactPair& pair, const WorldDef& def, Real h) {
  const Body &a = pair.a(), &b = pair.b();
  const Real from = std::max(a.is_awake() ? a.from : 0, b.is_awake() ? b.from : 0);
  std::optional<Real> first;
  for (const PlacedManifold& m : pair.manifolds())
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const ContactPoint& point = m.manifold.points[k];
      const Real speed = pair.relative_velocity((point.on_a + point.on_b) / 2).dot(m.frame.n);
      if (speed >= -def.collision_speed) continue;
      if (point.separation <= kTouching) return from;
      // Both points move with their features; the normal turns with the body that defines it.
      const bool with_b = m.manifold.source == NormalSource::face_of_b;
      const Pose pose_a = a.placed_at(from, h), pose_b = b.placed_at(from, h);
      const Vec3 n = with_b ? pose_b.vector_to_body(m.frame.n) : pose_a.vector_to_body(m.frame.n);
      const auto gap = [&](Real time) {
        const Pose p = a.placed_at(time, h), q = b.placed_at(time, h);
        const Vec3 normal = with_b ? q.vector_to_world(n) : p.vector_to_world(n);
        return normal.dot(moved_point(a, m.manifold.piece_a, pose_a, p, point.on_a, -m.frame.n, -normal) -
                          moved_point(b, m.manifold.piece_b, pose_b, q, point.on_b, m.frame.n, normal));
      };
      Real early = from, late = first.value_or(h);
      if (gap(late) > kTouching / 2) continue;
      for (int i = 0; i < 40 && late - early > kInstant * h; ++i) {
        const Real middle = (early + late) / 2;
        (gap(middle) > kTouching / 2 ? early : late) = middle;
      }
      first = late;
    }
  return first;
}

}  // namespace

std::optional<Real> impact_time(const ContactPair& pair, const WorldDef& def, Real h, TestCounts& tests) {
  if (pair.toi_exhausted) return std::nullopt;
  const Body &a = pair.a(), &b = pair.b();
  const Real from = std::max(a.is_awake() ? a.from : 0, b.is_awake() ? b.from : 0);
  if (from >= h * (1 - kInstant)) return std::nullopt;
  const Real turn = turn_of(pair) * (h - from);
  if (turn > kImpactTurn) return tumbling_impact_time(pair, def, from, h, turn, tests);
  if (pair.separation() <= kTouching) {
    const std::optional<Real> at_points = point_impact_time(pair, def, h);
    if (!turns_other_points(a, h - from) && !turns_other_points(b, h - from)) return at_points;
    const std::optional<Real> beside = tumbling_impact_time(pair, def, from, h, turn, tests);
    return at_points && beside ? std::min(at_points, beside) : at_points ? at_points : beside;
  }
  const Real bow = (bend(a, h) - bend(b, h)).norm() * (h - from) / 8;
  const auto pieces =
      static_cast<uint32_t>(std::min(std::max(1.0, std::ceil(std::sqrt(bow / kStraight))), kMostArcs));
  for (uint32_t i = 0; i < pieces; ++i) {
    const Real begin = from + (h - from) * i / pieces, end = from + (h - from) * (i + 1) / pieces;
    const PosePath path_a(on_arc(a, begin, h), on_arc(a, end, h)),
        path_b(on_arc(b, begin, h), on_arc(b, end, h));
    const auto impact =
        first_impact({pair.impact_shape_a(), path_a, &tests}, {pair.impact_shape_b(), path_b}, def);
    if (impact) return begin + touching_fraction(*impact, path_a, path_b) * (end - begin);
  }
  return std::nullopt;
}

bool turns_fast(const ContactPair& pair, Real h) {
  return turn_of(pair) * h > kImpactTurn;
}

uint32_t search_pieces(const ContactPair& pair, Real h) {
  return pieces_of(turn_of(pair) * h);
}

}  // namespace offstage::sim
