#include "sim/collision/time_of_impact.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "sim/collision/gjk.h"

namespace offstage::sim {
namespace {

/// An axis passes through the origin if its distance from it is at most this [m].
constexpr Real kOnAxis = 1e-9;

/// Greatest number of advances. It is enough for pairs whose bound of the closing speed is at most a hundred
/// times the true speed.
constexpr int kMaxAdvances = 2000;

Pose relative(const Pose& a, const Pose& b) {
  return {a.point_to_body(b.position), a.orientation.conjugate() * b.orientation};
}

/// Returns the largest d.p of all points of a core in its orientation, relative to the origin of its frame. d
/// is in world axes.
Real extent(const Convex& shape, const Quat& orientation, const Vec3& d) {
  const Vec3 local = orientation.conjugate() * d;
  uint32_t start = 0;
  return local.dot(shape.support(local, start));
}

/// Returns the greatest distance of the core's points from the origin of the frame [m].
Real core_reach(const Convex& shape) {
  return shape.reach() - shape.radius;
}

/// Returns the axis through the origin of the solid's frame about which its core is symmetric, if there is
/// one.
std::optional<Vec3> axis_of(const Convex& shape) {
  if (shape.core != Convex::Core::segment && shape.core != Convex::Core::cylinder &&
      shape.core != Convex::Core::cone)
    return {};
  if (!shape.place) return Vec3::UnitY();
  const Vec3 axis = shape.place->vector_to_world(Vec3::UnitY());
  if (!axis.cross(shape.place->position).isZero(kOnAxis)) return {};
  return axis;
}

/// Advances until the solids are within the tolerance. `gap_at(fraction, separation)` measures the gap and
/// writes the separation. Each advance aims at half the tolerance, so their number is finite.
template <class GapAt>
std::optional<Impact> advance(const GapAt& gap_at, Real tolerance) {
  Impact impact{0, {}};
  for (impact.advances = 1; impact.advances <= kMaxAdvances; ++impact.advances) {
    const Gap gap = gap_at(impact.fraction, impact.separation);
    if (gap.distance <= tolerance) return impact;
    const Real next = impact.fraction + gap.time_to(tolerance / 2);
    if (!(next < 1)) return std::nullopt;
    impact.fraction = next;
  }
  impact.converged = false;
  return impact;
}

}  // namespace

Real Gap::time_to(Real target) const {
  const Real room = distance - target;
  if (room <= 0) return 0;
  const Real root = std::sqrt(rate * rate + 2 * acceleration * room);
  // This is the positive root of room = rate t + acceleration t^2 / 2, in a form without cancellation.
  if (rate > 0) return 2 * room / (rate + root);
  return acceleration > 0 ? (root - rate) / acceleration : kInfinity;
}

// The axis e of a round core turns with w' = w - (w.e) e. Its inclination w.e / |w| = c is constant, since
// the path turns about a fixed axis. Let s = |w'| / |w|. A point at distance 1 that turns with w' has at most
// the centripetal acceleration s^2 w^2, and the tangential accelerations s |dw/dt| of the path and s |c| w^2
// of the moving e. Their sum is at most sqrt(2) s times the path's bound of |dw/dt| + w^2.
CoreRotation core_rotation(const MovingConvex& solid, Real fraction) {
  const PosePath& path = solid.path;
  if (!path.turns() || (solid.shape.core == Convex::Core::point && !solid.shape.place)) return {};
  const CoreRotation all{path.angular_velocity(fraction), path.max_acceleration(1)};
  const std::optional<Vec3> own = axis_of(solid.shape);
  if (!own) return all;
  const Vec3 axis = path.at(fraction).vector_to_world(*own);
  const Vec3 of_axis = all.velocity - all.velocity.dot(axis) * axis;
  const Real factor = std::numbers::sqrt2 * of_axis.norm() / all.velocity.norm();
  return factor < 1 ? CoreRotation{of_axis, factor * all.acceleration} : all;
}

Gap closing_gap(const MovingConvex& a, const MovingConvex& b, Real fraction, Real distance,
                const Vec3& normal) {
  Gap gap{distance, normal.dot(b.path.velocity() - a.path.velocity()), 0};
  const CoreRotation turn_a = core_rotation(a, fraction), turn_b = core_rotation(b, fraction);
  // For the points of A: -n.(w x r) = r.(w x n). For the points of B: n.(w x r) = r.(n x w). The radius
  // around a core does not turn.
  if (turn_a.acceleration > 0) {
    gap.rate += extent(a.shape, a.path.at(fraction).orientation, turn_a.velocity.cross(normal));
    gap.acceleration += core_reach(a.shape) * turn_a.acceleration;
  }
  if (turn_b.acceleration > 0) {
    gap.rate += extent(b.shape, b.path.at(fraction).orientation, normal.cross(turn_b.velocity));
    gap.acceleration += core_reach(b.shape) * turn_b.acceleration;
  }
  return gap;
}

std::optional<Impact> time_of_impact(const MovingConvex& a, const MovingConvex& b, Real tolerance) {
  GjkCache cache;
  const auto gap_at = [&](Real fraction, Separation& s) {
    const Pose pose = a.path.at(fraction);
    s = gjk(a.shape, b.shape, relative(pose, b.path.at(fraction)), cache);
    return closing_gap(a, b, fraction, s.distance, pose.vector_to_world(s.normal));
  };
  return advance(gap_at, tolerance);
}

// The height of a point a of the solid over a plane through o is n.(a - o). While the plane turns with w
// about o, its rate is n.(v_a - v_o) + (w x n).(a - o): as if the plane were fixed and the point moved with
// the opposite rotation. The relative acceleration seen from the plane has the Coriolis and centripetal terms
// in addition.
std::optional<Impact> time_of_plane_impact(const MovingConvex& a, const PosePath& plane, Real tolerance) {
  const Real reach = core_reach(a.shape);
  // The greatest distance of a point of the core from the plane's origin occurs at one end of the motion.
  const Real lever =
      reach + std::sqrt(std::max((a.path.start().position - plane.start().position).squaredNorm(),
                                 (a.path.end().position - plane.end().position).squaredNorm()));
  const Vec3 travel = a.path.velocity() - plane.velocity();
  const auto gap_at = [&](Real fraction, Separation& s) {
    const Pose pose = a.path.at(fraction), ground = plane.at(fraction);
    const Vec3 up = ground.vector_to_world(Vec3::UnitY()), w = plane.angular_velocity(fraction);
    const CoreRotation turn = core_rotation(a, fraction);
    const Vec3 down = pose.vector_to_body(-up);
    uint32_t start = 0;
    const Vec3 deepest = a.shape.support(down, start) + a.shape.radius * down;
    s = {};
    s.normal = -down;
    s.distance = up.dot(pose.point_to_world(deepest) - ground.position);
    s.on_a = deepest;
    s.on_b = deepest - s.distance * s.normal;
    s.iterations = 1;
    const Vec3 turning = w.cross(up);
    Gap gap{s.distance, -up.dot(travel) - turning.dot(pose.position - ground.position), 0};
    gap.rate += extent(a.shape, pose.orientation, turn.velocity.cross(up) - turning);
    const Real fastest = a.path.turns() ? std::sqrt(a.path.max_acceleration(1)) : 0,
               ground_fastest = plane.turns() ? std::sqrt(plane.max_acceleration(1)) : 0;
    gap.acceleration = reach * turn.acceleration + plane.max_acceleration(lever) +
                       2 * ground_fastest * (travel.norm() + fastest * reach);
    return gap;
  };
  return advance(gap_at, tolerance);
}

}  // namespace offstage::sim
