/// The part of ContactPair that keeps the forces at contact points from step to step: they are the initial
/// guess of the next solution.

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "sim/contact/contact_pair.h"
#include "sim/contact/manifold_placing.h"

namespace offstage::sim {
namespace {

/// Points closer to each other than this are identical, even if their ids differ [m].
constexpr Real kSame = 5e-3;
/// The squared distance of points with equal ids is multiplied by this, so that they are preferred.
constexpr Real kSameFeature = 1.0 / 16;
/// With more points than this, candidates are found by binary search and not compared one by one.
constexpr std::size_t kManyPoints = 16;
/// A contact can continue another one only if the cosine of the angle between their normals is greater than
/// this.
constexpr Real kAlong = 0.7;
/// Fraction of the spread of points that is added to the spread, so that its matrix can be inverted.
constexpr Real kFlat = 1e-6;

/// Fractions of a force that the points of a manifold get, so that the force acts at `centre` (in a's frame,
/// as `frame`). Their sum is 1. They are linear over the plane of the points, so that their weighted mean is
/// `centre` if it lies among the points.
using Weights = std::array<Real, 4>;
Weights weights(const Manifold& m, const ContactFrame& frame, const Pose& a, const Vec3& centre) {
  const uint32_t count = m.count;
  std::array<Eigen::Vector2d, 4> at;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (uint32_t k = 0; k < count; ++k) {
    const Vec3 p = a.point_to_body(m.points[k].on_a) - centre;
    at[k] = {frame.t.dot(p), frame.k.dot(p)};
    middle += at[k] / count;
  }
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (uint32_t k = 0; k < count; ++k) spread += (at[k] - middle) * (at[k] - middle).transpose();
  // The spread of collinear or equal points is singular. The addition does not change the result otherwise.
  spread += kFlat * (spread.trace() + kSame * kSame) * Eigen::Matrix2d::Identity();
  const Eigen::Vector2d slope = -spread.inverse() * middle;
  Weights result{};
  Real sum = 0;
  for (uint32_t k = 0; k < count; ++k)
    sum += result[k] = std::max(0.0, 1.0 / count + slope.dot(at[k] - middle));
  for (Real& w : result) w /= sum;
  return result;
}

}  // namespace

/// Converts a stored force to a new frame. The normal force stays along the normal even if the bodies have
/// turned far, because they may roll.
PointForce ContactPair::stored_force(const StoredPoint& p, const ContactFrame& frame, const Mat3& a_axes) {
  const auto force = [&](const Vec3& before) -> Vec3 {
    const Real normal = before.dot(p.normal);
    const Vec3 tangential = a_axes * (before - normal * p.normal);
    return {normal, frame.t.dot(tangential), frame.k.dot(tangential)};
  };
  const Vec3 last = force(p.last);
  return {last, last, force(p.mean), true};
}

/// Stores the points with their forces in a's frame. The tangents of a contact frame can jump although its
/// normal hardly moves.
void ContactPair::store_points(std::vector<StoredPoint>& points) const {
  if (placed_.empty()) return;
  const PoseMatrix at(placed_at_);
  for (const PlacedManifold& m : placed_) {
    const Vec3 normal = at.vector_to_body(m.frame.n);
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const ContactPoint& p = m.manifold.points[k];
      points.push_back({at.point_to_body(p.on_a), at.vector_to_body(m.frame.vector(m.forces[k].last)),
                        at.vector_to_body(m.frame.vector(m.forces[k].mean)), normal, m.torque, m.mean_torque,
                        p.id, false});
    }
  }
}

/// Gives the stored forces to the points that existed before, which are recognized by id or else by distance.
/// Each stored force is used once. Otherwise the forces of a pair that is found repeatedly would grow without
/// limit.
void ContactPair::restore_forces(std::vector<StoredPoint>& points, const Pose& pose) {
  const PoseMatrix a(pose);
  // Two models of many parts have thousands of points. Then only points that are near along x or have the
  // same id are compared.
  const bool are_many = points.size() > kManyPoints;
  // Points of different pairs of parts may have the same id.
  const Real same_feature = kSame / std::sqrt(kSameFeature);
  static thread_local std::vector<std::pair<Real, uint32_t>> by_x;
  static thread_local std::vector<std::tuple<uint32_t, Real, uint32_t>> by_id;  // sorted by id, and then by x
  if (are_many) {
    by_x.clear();
    by_id.clear();
    for (uint32_t i = 0; i < points.size(); ++i) {
      by_x.emplace_back(points[i].on_a.x(), i);
      by_id.emplace_back(points[i].id, points[i].on_a.x(), i);
    }
    std::sort(by_x.begin(), by_x.end());
    std::sort(by_id.begin(), by_id.end());
  }
  for (PlacedManifold& m : placed_) {
    m.torque = m.mean_torque = 0;
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      m.forces[k] = {};
      const ContactPoint& point = m.manifold.points[k];
      const Vec3 on_a = a.point_to_body(point.on_a);
      StoredPoint* best = nullptr;
      Real nearest = kSame * kSame;
      const auto compare = [&](StoredPoint& p) {
        const Real distance = (p.on_a - on_a).squaredNorm() * (p.id == point.id ? kSameFeature : 1);
        // The first of several equally near points is used.
        if (p.taken || distance > nearest || (distance == nearest && (!best || best < &p))) return;
        nearest = distance;
        best = &p;
      };
      if (are_many) {
        for (auto at = std::lower_bound(by_x.begin(), by_x.end(), std::pair(on_a.x() - kSame, 0u));
             at != by_x.end() && at->first <= on_a.x() + kSame; ++at)
          compare(points[at->second]);
        for (auto at = std::lower_bound(by_id.begin(), by_id.end(),
                                        std::tuple(point.id, on_a.x() - same_feature, 0u));
             at != by_id.end() && std::get<0>(*at) == point.id && std::get<1>(*at) <= on_a.x() + same_feature;
             ++at)
          compare(points[std::get<2>(*at)]);
      } else {
        for (StoredPoint& p : points) compare(p);
      }
      if (!best) continue;
      best->taken = true;
      m.forces[k] = stored_force(*best, m.frame, a.axes);
      m.torque = best->torque;
      m.mean_torque = best->mean_torque;
    }
  }
}

/// Transfers the forces of points that have disappeared to the current points. Faces that lie on each other
/// may have different corners in every step, but their load does not change. The forces go to the first
/// manifold with a similar normal. They are distributed over its points so that their sum acts where it did,
/// as far as the points extend.
void ContactPair::inherit(std::vector<StoredPoint>& points, const Pose& a) {
  static thread_local std::vector<StoredPoint*> left;
  left.clear();
  for (StoredPoint& p : points)
    if (!p.taken && !(p.last.isZero(0) && p.mean.isZero(0))) left.push_back(&p);
  if (left.empty()) return;
  for (PlacedManifold& m : placed_) {
    const ContactFrame frame{a.vector_to_body(m.frame.n), a.vector_to_body(m.frame.t),
                             a.vector_to_body(m.frame.k)};
    Vec3 force = Vec3::Zero(), mean = Vec3::Zero(), moment = Vec3::Zero();
    Real pressure = 0;
    for (StoredPoint* remembered : left) {
      StoredPoint& p = *remembered;
      // Directions are kept in the world, even if a rolling body has turned far.
      const Vec3 before = placed_at_.vector_to_world(p.normal);
      if (p.taken || !(before.dot(m.frame.n) > kAlong)) continue;
      const auto along_normal = [&](const Vec3& f) {
        const Real normal = f.dot(p.normal);
        return Vec3(normal * frame.n +
                    a.vector_to_body(placed_at_.vector_to_world(Vec3(f - normal * p.normal))));
      };
      p.taken = true;
      force += along_normal(p.last);
      mean += along_normal(p.mean);
      const Real normal = p.last.dot(p.normal);
      moment += normal * p.on_a;
      pressure += normal;
    }
    if (pressure == 0) continue;
    const Weights fractions = weights(m.manifold, frame, a, moment / pressure);
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      m.forces[k].last += fractions[k] * frame.components(force);
      m.forces[k].mean += fractions[k] * frame.components(mean);
    }
  }
}

}  // namespace offstage::sim
