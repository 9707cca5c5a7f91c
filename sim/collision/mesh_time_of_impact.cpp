/// time_of_impact() for shapes with many pieces.

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <type_traits>

#include "sim/collision/narrow_phase.h"
#include "sim/collision/tree_pair.h"

namespace offstage::sim {
namespace {

constexpr int kMaxMeshAdvances = 2000;
/// Number of times within the step at which shapes that touch at its start are sampled.
constexpr int kLooks = 32;

/// A lower bound of the distance of two volumes along a direction from B to A, in A's frame.
struct DirectedGap {
  Real distance;
  Vec3 normal;
};

Mat3 axes_of(const Aabb&) {
  return Mat3::Identity();
}
Mat3 axes_of(const Obb& box) {
  return box.axes;
}

/// Returns a gap of two volumes along a direction that suits them. For two boxes this is the axis of either
/// box along which they are farthest apart, for two spheres the line of the centres, and for a sphere and a
/// box one of the box's axes.
template <class A, class B>
DirectedGap directed_gap(const A& a, const B& b, const Placement& p) {
  const Vec3 offset = p.point(centre(b)) - centre(a);
  if constexpr (kIsSphere<A> && kIsSphere<B>) {
    const Real distance = offset.norm();
    if (!(distance > 0)) return {-a.radius - b.radius, Vec3::UnitX()};
    return {distance - a.radius - b.radius, -offset / distance};
  } else if constexpr (kIsSphere<A> || kIsSphere<B>) {
    Mat3 axes;
    Vec3 half;
    Real radius;
    if constexpr (kIsSphere<A>) {
      axes = p.rotation * axes_of(b);
      half = half_sizes(b);
      radius = a.radius;
    } else {
      axes = axes_of(a);
      half = half_sizes(a);
      radius = b.radius;
    }
    const Vec3 local = axes.transpose() * offset;
    int k;
    const Real distance = (local.cwiseAbs() - half).maxCoeff(&k) - radius;
    return {distance, local[k] > 0 ? Vec3(-axes.col(k)) : Vec3(axes.col(k))};
  } else if constexpr (std::is_same_v<A, Aabb> && std::is_same_v<B, Aabb>) {
    const Mat3& R = p.rotation;
    const Vec3 half_a = half_sizes(a), half_b = half_sizes(b);
    const Vec3 gaps_a = offset.cwiseAbs() - half_a - R.cwiseAbs() * half_b,
               gaps_b = (R.transpose() * offset).cwiseAbs() - half_b - R.transpose().cwiseAbs() * half_a;
    int i, j;
    const Real gap_a = gaps_a.maxCoeff(&i), gap_b = gaps_b.maxCoeff(&j);
    Vec3 normal = gap_a >= gap_b ? Vec3(Vec3::Unit(i)) : Vec3(R.col(j));
    if (normal.dot(offset) > 0) normal = -normal;
    return {std::max(gap_a, gap_b), normal};
  } else {
    const Mat3 axes_a = axes_of(a), axes_b = p.rotation * axes_of(b), R = axes_a.transpose() * axes_b;
    const Vec3 local = axes_a.transpose() * offset, half_a = half_sizes(a), half_b = half_sizes(b);
    const Vec3 gaps_a = local.cwiseAbs() - half_a - R.cwiseAbs() * half_b,
               gaps_b = (R.transpose() * local).cwiseAbs() - half_b - R.transpose().cwiseAbs() * half_a;
    int i, j;
    const Real gap_a = gaps_a.maxCoeff(&i), gap_b = gaps_b.maxCoeff(&j);
    Vec3 normal = gap_a >= gap_b ? Vec3(axes_a.col(i)) : Vec3(axes_b.col(j));
    if (normal.dot(offset) > 0) normal = -normal;
    return {std::max(gap_a, gap_b), normal};
  }
}

/// Returns the greatest distance of a volume's points from the origin of the frame [m].
Real volume_reach(const Aabb& box) {
  return box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).norm();
}
Real volume_reach(const Obb& box) {
  return box.centre.norm() + box.half.norm();
}
Real volume_reach(const BoundingSphere& sphere) {
  return sphere.centre.norm() + sphere.radius;
}

/// Two shapes at one time of their motions.
class Instant {
 public:
  Instant(const MovingShape& a, const MovingShape& b, Real fraction, Real tolerance)
      : a_(a),
        b_(b),
        fraction_(fraction),
        tolerance_(tolerance),
        pose_a_(a.path.at(fraction)),
        pose_b_(b.path.at(fraction)),
        a_from_b_{pose_a_.point_to_body(pose_b_.position),
                  pose_a_.orientation.conjugate() * pose_b_.orientation},
        placement_(a_from_b_, a.shape.reach() + b.shape.reach(), 0),
        closing_(pose_a_.vector_to_body(b.path.velocity() - a.path.velocity())),
        turn_a_(turn_in_a(a)),
        turn_b_(turn_in_a(b)) {}

  const Pose& a_from_b() const { return a_from_b_; }
  /// Returns the two closest pieces, if any pieces are in contact at this time.
  const std::optional<Separation>& contact() const { return contact_; }

  /// Returns a lower bound of the time until any two pieces come within half the tolerance, or 0 if two of
  /// them are within it now.
  Real time_to_contact(Real limit) {
    time_ = limit;
    with_trees(a_.shape, b_.shape,
               [&](const auto& tree_a, const auto& tree_b) { search(tree_a, tree_b, limit); });
    return time_;
  }

 private:
  /// Returns the rotation of all pieces of a shape, in A's frame. Shapes of several pieces are treated as
  /// without an axis of revolution.
  CoreRotation turn_in_a(const MovingShape& s) const {
    CoreRotation turn = s.shape.piece_count() == 1
                            ? core_rotation({s.shape.hull(), s.path}, fraction_)
                            : CoreRotation{s.path.angular_velocity(fraction_), s.path.max_acceleration(1)};
    turn.velocity = pose_a_.vector_to_body(turn.velocity);
    return turn;
  }
  template <class A, class B>
  void search(const BoundingTree<A>& tree_a, const BoundingTree<B>& tree_b, Real limit) {
    NodePairStack<A, B> stack;  // `gap` holds the time here
    const auto timed = [&](NodePair<A, B> pair) {
      if (a_.counts) ++a_.counts->volumes;
      pair.gap = node_time(*pair.a, *pair.b);
      return pair;
    };
    stack.push(timed({&tree_a.nodes()[0], &tree_b.nodes()[0]}));
    while (!stack.empty()) {
      const NodePair<A, B> pair = stack.pop();
      // Touching pairs have the time 0. The nearest of them is wanted, so pairs with equal times are not
      // skipped.
      if (pair.gap > time_ || pair.gap >= limit) continue;
      if (pair.a->is_leaf() && pair.b->is_leaf()) {
        for (uint32_t i : tree_a.items(*pair.a))
          for (uint32_t j : tree_b.items(*pair.b)) time_ = std::min(time_, piece_time(i, j));
        continue;
      }
      auto [near, far] = descend(tree_a, tree_b, pair);
      near = timed(near);
      far = timed(far);
      if (far.gap < near.gap) std::swap(near, far);
      stack.push(far);
      stack.push(near);
    }
  }

  /// Returns a lower bound of the time for all pieces below two nodes.
  template <class NodeA, class NodeB>
  Real node_time(const NodeA& a, const NodeB& b) const {
    const DirectedGap directed = directed_gap(a.volume, b.volume, placement_);
    const Vec3& normal = directed.normal;
    const Real reach_a = volume_reach(a.volume), reach_b = volume_reach(b.volume);
    Gap gap{directed.distance - placement_.slack, normal.dot(closing_), 0};
    if (turn_a_.acceleration > 0) {
      gap.rate += turn_a_.velocity.cross(normal).norm() * reach_a;
      gap.acceleration += turn_a_.acceleration * reach_a;
    }
    if (turn_b_.acceleration > 0) {
      gap.rate += turn_b_.velocity.cross(normal).norm() * reach_b;
      gap.acceleration += turn_b_.acceleration * reach_b;
    }
    return gap.time_to(tolerance_ / 2);
  }

  Real piece_time(uint32_t i, uint32_t j) {
    if (a_.counts) ++a_.counts->pieces;
    const Convex p = a_.shape.piece(i), q = b_.shape.piece(j);
    const Separation s = piece_separation(a_.shape, i, b_.shape, j, a_from_b_);
    if (s.distance <= tolerance_) {
      if (!contact_ || s.distance < contact_->distance) contact_ = s;
      return 0;
    }
    return closing_gap({p, a_.path}, {q, b_.path}, fraction_, s.distance, pose_a_.vector_to_world(s.normal))
        .time_to(tolerance_ / 2);
  }

  const MovingShape &a_, &b_;
  Real fraction_, tolerance_;
  Pose pose_a_, pose_b_, a_from_b_;
  Placement placement_;
  Vec3 closing_;  // in A's frame
  CoreRotation turn_a_, turn_b_;
  Real time_ = kInfinity;
  std::optional<Separation> contact_;
};

/// Returns, for all points of a shape, an upper bound of the deviation of their speed from the speed in a
/// constant rotation [m per step]. The rate of rotation deviates from a constant one by at most the fraction
/// angle^2 / 24.
Real unevenness(const MovingShape& s) {
  if (s.shape.is_plane()) return 0;
  return s.path.turn() * s.path.max_acceleration(s.shape.reach()) / 24;
}

/// Returns the velocity of the material point that is at `place` [m per step].
Vec3 velocity(const PosePath& path, Real fraction, const Vec3& place) {
  return path.velocity() + path.angular_velocity(fraction).cross(place - path.at(fraction).position);
}

/// Returns the first impact of any hull of a shape with a plane.
std::optional<Impact> first_plane_impact(const MovingShape& a, const PosePath& plane, Real tolerance) {
  std::optional<Impact> first;
  for (const Convex& hull : a.shape.hulls()) {
    const std::optional<Impact> impact = time_of_plane_impact({hull, a.path}, plane, tolerance);
    if (impact && (!first || impact->fraction < first->fraction)) first = impact;
  }
  return first;
}

}  // namespace

std::optional<Impact> bisected_time_of_impact(const MovingShape& a, const MovingShape& b, Real tolerance) {
  constexpr int kMostHalvings = 60;
  const auto a_from_b = [&](Real fraction) {
    const Pose at_a = a.path.at(fraction), at_b = b.path.at(fraction);
    return Pose{at_a.point_to_body(at_b.position), at_a.orientation.conjugate() * at_b.orientation};
  };
  TestCounts uncounted;
  TestCounts& counts = a.counts ? *a.counts : uncounted;
  const auto touch_at = [&](Real fraction) { return touching(a.shape, b.shape, a_from_b(fraction), counts); };
  if (!touch_at(1)) return std::nullopt;
  // Upper bound of the relative speed of any two points [m per step].
  const auto fastest = [](const MovingShape& s) {
    return s.shape.is_plane() ? s.path.velocity().norm()
                              : s.path.velocity().norm() + s.path.turn() * s.shape.reach();
  };
  const Real speed = fastest(a) + fastest(b);
  Impact impact{.fraction = 0, .separation = {}};
  Real low = 0, high = 1;
  if (!touch_at(0))
    while ((high - low) * speed > tolerance / 2 && impact.advances < kMostHalvings) {
      const Real middle = (low + high) / 2;
      (touch_at(middle) ? high : low) = middle;
      ++impact.advances;
    }
  else
    high = 0;
  impact.fraction = low;
  impact.converged = (high - low) * speed <= tolerance / 2;
  PairCache none;
  if (const auto s = separation(a.shape, b.shape, a_from_b(low), none)) impact.separation = *s;
  return impact;
}

std::optional<Impact> time_of_impact(const MovingShape& a, const MovingShape& b, Real tolerance) {
  assert(!a.shape.is_plane());
  if (b.shape.is_plane()) return first_plane_impact(a, b.path, tolerance);
  const MovingConvex hull_a{a.shape.hull(), a.path};
  const bool convex = !a.shape.is_hollow() && !b.shape.is_hollow() && a.shape.piece_count() == 1 &&
                      b.shape.piece_count() == 1;
  if (convex) {
    const auto found = time_of_impact(hull_a, {b.shape.hull(), b.path}, tolerance);
    if (a.counts) a.counts->pieces += found ? static_cast<uint64_t>(found->advances) : 1;
    return found;
  }

  Impact impact{0, {}};
  for (impact.advances = 1;; ++impact.advances) {
    Instant instant(a, b, impact.fraction, tolerance);
    const Real time = instant.time_to_contact(1 - impact.fraction);
    if (instant.contact()) {
      impact.separation = *instant.contact();
      return impact;
    }
    if (impact.fraction == 0) {
      PairCache none;
      const auto s = separation(a.shape, b.shape, instant.a_from_b(), none, DistanceMethod::gjk, 0);
      if (s) {
        impact.separation = *s;
        return impact;
      }
    }
    if (impact.fraction + time >= 1) return std::nullopt;
    impact.fraction += time;
    if (impact.advances == kMaxMeshAdvances) break;
  }
  impact.converged = false;
  PairCache none;
  if (const auto s = separation(a.shape, b.shape, Instant(a, b, impact.fraction, tolerance).a_from_b(), none))
    impact.separation = *s;
  return impact;
}

std::optional<Impact> time_of_next_impact(const MovingShape& a, const MovingShape& b, Real tolerance,
                                          Real speed) {
  PairCache cache;
  const Real least = speed + unevenness(a) + unevenness(b);
  for (int look = 1; look < kLooks; ++look) {
    const Real fraction = Real(look) / kLooks;
    const Pose pose_a = a.path.at(fraction), pose_b = b.path.at(fraction);
    const Pose a_from_b{pose_a.point_to_body(pose_b.position),
                        pose_a.orientation.conjugate() * pose_b.orientation};
    const auto s = separation(a.shape, b.shape, a_from_b, cache, DistanceMethod::gjk, tolerance);
    if (!s) {
      const PosePath rest_a(pose_a, a.path.end()), rest_b(pose_b, b.path.end());
      auto impact = time_of_impact({a.shape, rest_a}, {b.shape, rest_b}, tolerance);
      if (impact) impact->fraction = fraction + impact->fraction * (1 - fraction);
      return impact;
    }
    const Vec3 at_a = pose_a.point_to_world(s->on_a), at_b = pose_a.point_to_world(s->on_b);
    const Vec3 approach = velocity(b.path, fraction, at_b) - velocity(a.path, fraction, at_a);
    if (approach.dot(pose_a.vector_to_world(s->normal)) > least) return Impact{fraction, *s, look, true};
  }
  return std::nullopt;
}

}  // namespace offstage::sim
