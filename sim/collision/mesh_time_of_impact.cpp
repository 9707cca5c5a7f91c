/// time_of_impact() for shapes with many pieces.

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "sim/collision/narrow_phase.h"
#include "sim/collision/tree_pair.h"

namespace offstage::sim {
namespace {

constexpr int kMaxMeshAdvances = 2000;
/// Number of points of the motion at which shapes that touch are sampled.
constexpr int kLooks = 32;

using Node = AabbTree::Node;

/// Two shapes at one time of their motions.
class Instant {
 public:
  Instant(const MovingShape& a, const MovingShape& b, Real share, Real tolerance)
      : a_(a),
        b_(b),
        share_(share),
        tolerance_(tolerance),
        pose_a_(a.path.at(share)),
        pose_b_(b.path.at(share)),
        a_from_b_{pose_a_.point_to_body(pose_b_.position),
                  pose_a_.orientation.conjugate() * pose_b_.orientation},
        placement_(a_from_b_, a.shape.hull().reach() + b.shape.hull().reach(), 0),
        closing_(pose_a_.vector_to_body(b.path.velocity() - a.path.velocity())),
        spin_a_(pose_a_.vector_to_body(a.path.angular_velocity(share))),
        spin_b_(pose_a_.vector_to_body(b.path.angular_velocity(share))) {}

  const Pose& a_from_b() const { return a_from_b_; }
  /// The closest two pieces, if any are in contact at this time.
  const std::optional<Separation>& contact() const { return contact_; }

  /// Returns a lower bound of the time until any two pieces come within half the tolerance; 0 if two are
  /// within it now.
  Real time_to_contact(Real limit) {
    time_ = limit;
    const AabbTree &tree_a = a_.shape.tree(), &tree_b = b_.shape.tree();
    NodePairStack<Aabb, Aabb> stack;  // `gap` holds the time here
    const auto timed = [&](NodePair<Aabb, Aabb> pair) {
      pair.gap = node_time(*pair.a, *pair.b);
      return pair;
    };
    stack.push(timed({&tree_a.nodes()[0], &tree_b.nodes()[0]}));
    while (!stack.empty()) {
      const NodePair<Aabb, Aabb> pair = stack.pop();
      // Touching pairs have time 0. The nearest of them is wanted, so pairs with equal times are not skipped.
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
    return time_;
  }

 private:
  /// Lower bound of the time for all pieces below two nodes, along the axis of the two boxes on which they
  /// are farthest apart.
  Real node_time(const Node& a, const Node& b) const {
    const Mat3& R = placement_.rotation;
    const Vec3 offset = placement_.point(centre(b.volume)) - centre(a.volume);
    const Vec3 half_a = half_sizes(a.volume), half_b = half_sizes(b.volume);
    const Vec3 gaps_a = offset.cwiseAbs() - half_a - R.cwiseAbs() * half_b,
               gaps_b = (R.transpose() * offset).cwiseAbs() - half_b - R.transpose().cwiseAbs() * half_a;
    int i, j;
    const Real gap_a = gaps_a.maxCoeff(&i), gap_b = gaps_b.maxCoeff(&j);
    Vec3 normal = gap_a >= gap_b ? Vec3(Vec3::Unit(i)) : Vec3(R.col(j));
    if (normal.dot(offset) > 0) normal = -normal;  // from B to A
    const Real reach_a = reach(a.volume), reach_b = reach(b.volume);
    Gap gap{std::max(gap_a, gap_b) - placement_.slack, normal.dot(closing_), 0};
    if (a_.path.turns()) {
      gap.rate += spin_a_.cross(normal).norm() * reach_a;
      gap.acceleration += a_.path.max_acceleration(reach_a);
    }
    if (b_.path.turns()) {
      gap.rate += spin_b_.cross(normal).norm() * reach_b;
      gap.acceleration += b_.path.max_acceleration(reach_b);
    }
    return gap.time_to(tolerance_ / 2);
  }

  static Real reach(const Aabb& box) { return box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).norm(); }

  Real piece_time(uint32_t i, uint32_t j) {
    const Convex p = a_.shape.piece(i), q = b_.shape.piece(j);
    GjkCache fresh;
    const Separation s = gjk(p, q, a_from_b_, fresh);
    if (s.distance <= tolerance_) {
      if (!contact_ || s.distance < contact_->distance) contact_ = s;
      return 0;
    }
    return closing_gap({p, a_.path}, {q, b_.path}, share_, s.distance, pose_a_.vector_to_world(s.normal))
        .time_to(tolerance_ / 2);
  }

  const MovingShape &a_, &b_;
  Real share_, tolerance_;
  Pose pose_a_, pose_b_, a_from_b_;
  Placement placement_;
  Vec3 closing_, spin_a_, spin_b_;  // A's frame
  Real time_ = kInfinity;
  std::optional<Separation> contact_;
};

/// Bound of the deviation of a path's speed from that of a constant rotation, for all points of a shape [m
/// per step]. The rate of a path deviates from a constant one by at most angle^2 / 24.
Real unevenness(const MovingShape& s) {
  if (s.shape.is_plane()) return 0;
  return s.path.turn() * s.path.max_acceleration(s.shape.hull().reach()) / 24;
}

/// Velocity of the material point that is at `place` [m per step].
Vec3 velocity(const PosePath& path, Real share, const Vec3& place) {
  return path.velocity() + path.angular_velocity(share).cross(place - path.at(share).position);
}

}  // namespace

std::optional<Impact> bisected_time_of_impact(const MovingShape& a, const MovingShape& b, Real tolerance) {
  constexpr int kMostHalvings = 60;
  const auto a_from_b = [&](Real share) {
    const Pose at_a = a.path.at(share), at_b = b.path.at(share);
    return Pose{at_a.point_to_body(at_b.position), at_a.orientation.conjugate() * at_b.orientation};
  };
  const auto touch_at = [&](Real share) { return touching(a.shape, b.shape, a_from_b(share)); };
  if (!touch_at(1)) return std::nullopt;
  // Bound of the relative speed of any two points [m per step].
  const auto fastest = [](const MovingShape& s) {
    return s.shape.is_plane() ? s.path.velocity().norm()
                              : s.path.velocity().norm() + s.path.turn() * s.shape.hull().reach();
  };
  const Real speed = fastest(a) + fastest(b);
  Impact impact{.share = 0, .separation = {}};
  Real low = 0, high = 1;
  if (!touch_at(0))
    while ((high - low) * speed > tolerance / 2 && impact.advances < kMostHalvings) {
      const Real middle = (low + high) / 2;
      (touch_at(middle) ? high : low) = middle;
      ++impact.advances;
    }
  else
    high = 0;
  impact.share = low;
  impact.converged = (high - low) * speed <= tolerance / 2;
  PairCache none;
  if (const auto s = separation(a.shape, b.shape, a_from_b(low), none)) impact.separation = *s;
  return impact;
}

std::optional<Impact> time_of_impact(const MovingShape& a, const MovingShape& b, Real tolerance) {
  assert(!a.shape.is_plane());
  const MovingConvex hull_a{a.shape.hull(), a.path};
  if (b.shape.is_plane()) return time_of_plane_impact(hull_a, b.path, tolerance);
  const bool convex = !a.shape.is_hollow() && !b.shape.is_hollow() && a.shape.piece_count() == 1 &&
                      b.shape.piece_count() == 1;
  if (convex) return time_of_impact(hull_a, {b.shape.hull(), b.path}, tolerance);

  Impact impact{0, {}};
  for (impact.advances = 1;; ++impact.advances) {
    Instant instant(a, b, impact.share, tolerance);
    const Real time = instant.time_to_contact(1 - impact.share);
    if (instant.contact()) {
      impact.separation = *instant.contact();
      return impact;
    }
    if (impact.share == 0) {
      PairCache none;
      const auto s = separation(a.shape, b.shape, instant.a_from_b(), none, DistanceMethod::gjk, 0);
      if (s) {
        impact.separation = *s;
        return impact;
      }
    }
    if (impact.share + time >= 1) return std::nullopt;
    impact.share += time;
    if (impact.advances == kMaxMeshAdvances) break;
  }
  impact.converged = false;
  PairCache none;
  if (const auto s = separation(a.shape, b.shape, Instant(a, b, impact.share, tolerance).a_from_b(), none))
    impact.separation = *s;
  return impact;
}

std::optional<Impact> time_of_next_impact(const MovingShape& a, const MovingShape& b, Real tolerance,
                                          Real speed) {
  PairCache cache;
  const Real least = speed + unevenness(a) + unevenness(b);
  for (int look = 1; look < kLooks; ++look) {
    const Real share = Real(look) / kLooks;
    const Pose pose_a = a.path.at(share), pose_b = b.path.at(share);
    const Pose a_from_b{pose_a.point_to_body(pose_b.position),
                        pose_a.orientation.conjugate() * pose_b.orientation};
    const auto s = separation(a.shape, b.shape, a_from_b, cache, DistanceMethod::gjk, tolerance);
    if (!s) {
      const PosePath rest_a(pose_a, a.path.end()), rest_b(pose_b, b.path.end());
      auto impact = time_of_impact({a.shape, rest_a}, {b.shape, rest_b}, tolerance);
      if (impact) impact->share = share + impact->share * (1 - share);
      return impact;
    }
    const Vec3 at_a = pose_a.point_to_world(s->on_a), at_b = pose_a.point_to_world(s->on_b);
    const Vec3 approach = velocity(b.path, share, at_b) - velocity(a.path, share, at_a);
    if (approach.dot(pose_a.vector_to_world(s->normal)) > least) return Impact{share, *s, look, true};
  }
  return std::nullopt;
}

}  // namespace offstage::sim
