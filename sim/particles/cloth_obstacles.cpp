#include "sim/particles/cloth_obstacles.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/contact/collision.h"
#include "sim/geometry/closest_points.h"
#include "sim/geometry/intersection.h"
#include "sim/linear/rigid_mobility.h"
#include "sim/particles/particles.h"

namespace offstage::sim {
namespace {

/// Particles are kept from cloth at their radius and this fraction of it. A hit is detected at half of this
/// distance, so a particle that slides along flat cloth does not hit it in each sub-step.
constexpr Real kClothSkin = 1e-3;
/// Greatest number of advances in the search for a hit. The few searches that need more end with a hit that
/// is early by less than the last advance.
constexpr int kMaxClothAdvances = 48;
/// Greatest number of triangles, one after the other, that take a stopped particle along in a sub-step.
constexpr int kMaxCarriers = 16;

Vec3 normal_of(const Vec3& a, const Vec3& b, const Vec3& c) {
  return (b - a).cross(c - a).stableNormalized();
}

}  // namespace

void ClothObstacles::clear(BodyImpulses& impulses) {
  impulses_ = &impulses;
  from_.clear();
  to_.clear();
  velocity_.clear();
  inverse_mass_.clear();
  holder_.clear();
  holders_.clear();
  triangles_.clear();
  cloths_.clear();
}

uint32_t ClothObstacles::add_holder(const Obstacle& body) {
  holders_.push_back({body});
  return static_cast<uint32_t>(holders_.size() - 1);
}

void ClothObstacles::add(std::span<const Vec3> from, std::span<const Vec3> to,
                         std::span<const Vec3> velocities, std::span<const Real> inverse_masses,
                         std::span<const Triangle> triangles, Real friction, std::span<const Pin> pins) {
  const auto first = static_cast<uint32_t>(from_.size()), cloth = static_cast<uint32_t>(cloths_.size());
  from_.insert(from_.end(), from.begin(), from.end());
  to_.insert(to_.end(), to.begin(), to.end());
  velocity_.insert(velocity_.end(), velocities.begin(), velocities.end());
  inverse_mass_.insert(inverse_mass_.end(), inverse_masses.begin(), inverse_masses.end());
  holder_.resize(from_.size(), kNone);
  for (const Pin& pin : pins) {
    if (holder_[first + pin.point] != kNone) continue;  // pinned twice
    Holder& holder = holders_[pin.holder];
    holder_[first + pin.point] = pin.holder;
    const PointVelocity E = point_velocity(to[pin.point] - holder.body.centre_at(1));
    holder.carried += pin.mass * E.transpose() * E;
  }
  for (const Triangle& t : triangles)
    triangles_.push_back({{t[0] + first, t[1] + first, t[2] + first}, cloth});
  cloths_.push_back({first, friction});
}

void ClothObstacles::build() {
  boxes_.clear();
  for (const ClothTriangle& t : triangles_) {
    Aabb& box = boxes_.emplace_back();
    for (uint32_t point : t.corners) box.extend(from_[point]).extend(to_[point]);
  }
  if (triangles_ == in_tree_) return tree_.refit(boxes_);
  tree_ = AabbTree(boxes_);
  in_tree_ = triangles_;
}

Real ClothObstacles::kept_distance(Real radius) {
  return (1 + kClothSkin) * radius;
}

/// Conservative advancement: the triangle is behind the plane through its nearest point and perpendicular to
/// the line to the particle's centre, and each corner moves straight. So the centre is at least as far from
/// the triangle as from the planes through the corners that are parallel to this one.
std::optional<ClothObstacles::Hit> ClothObstacles::hit(uint32_t triangle, const Path& path,
                                                       Real latest) const {
  const Triangle& corners = triangles_[triangle].corners;
  Real t = path.from, reach = path.radius, margin = kClothSkin / 2 * path.radius;
  for (int i = 0; i <= kMaxClothAdvances; ++i) {
    std::array<Vec3, 3> at;
    for (std::size_t k = 0; k < 3; ++k) at[k] = corner(corners[k], t);
    const Vec3 p = path.at(t);
    const TrianglePoint nearest = closest_on_triangle(p, at[0], at[1], at[2]);
    Vec3 rate = path.rate;
    for (std::size_t k = 0; k < 3; ++k) rate -= nearest.weights[k] * (to_[corners[k]] - from_[corners[k]]);
    const Vec3 apart = p - nearest.point;
    const Real distance = apart.norm();
    Vec3 n = apart / distance;
    if (!(distance > 1e-9 * path.radius)) {
      n = normal_of(at[0], at[1], at[2]);
      if (n.dot(rate) > 0) n = -n;
    }
    if (distance <= reach + margin || i == kMaxClothAdvances) {
      if (rate.dot(n) < 0 || i == kMaxClothAdvances)
        return Hit{triangle, t, p, n, distance, {nearest.weights[0], nearest.weights[1], nearest.weights[2]}};
      if (distance < path.radius + margin) {  // it moves away, and may only come back to nearly this distance
        reach = std::min(reach, distance - std::min(2 * margin, distance / 2));
        margin = std::min(margin, (distance - reach) / 2);
      }
    }
    Real advance = std::numeric_limits<Real>::infinity();
    for (std::size_t k = 0; k < 3; ++k) {
      const Real closing = -n.dot(path.rate - (to_[corners[k]] - from_[corners[k]]));
      if (closing > 0) advance = std::min(advance, (n.dot(p - at[k]) - reach) / closing);
    }
    t += advance;
    if (!(t < std::min(latest, 1.0))) return {};
  }
  return {};
}

std::optional<ClothObstacles::Hit> ClothObstacles::first_hit(const Vec3& a, const Vec3& b, Real radius,
                                                             Real from, Real latest) const {
  if (!(from < 1)) return {};
  Aabb around(a.cwiseMin(b), a.cwiseMax(b));
  around.min().array() -= (1 + kClothSkin) * radius;
  around.max().array() += (1 + kClothSkin) * radius;
  std::optional<Hit> first;
  const Path path{a, (b - a) / (1 - from), from, radius};
  tree_.overlapping(around, [&](uint32_t k) {
    if (!boxes_[k].intersects(around)) return;
    if (auto found = hit(k, path, first ? first->fraction : latest)) first = found;
  });
  return first;
}

Vec3 ClothObstacles::held_end(const Vec3& a, const Vec3& b, Real radius, Real from) const {
  Vec3 start = a, end = b;
  for (int k = 0; k < kMaxCarriers; ++k) {
    const auto hit = first_hit(start, end, radius, from, 1);
    if (!hit) break;
    start = hit->position;
    end = carried(*hit);
    from = hit->fraction;
    radius /= 2;
  }
  return end;
}

bool ClothObstacles::separates(const Vec3& a, const Vec3& b, Real fraction) const {
  const Aabb around(a.cwiseMin(b), a.cwiseMax(b));
  bool found = false;
  tree_.overlapping(around, [&](uint32_t k) {
    const Triangle& t = triangles_[k].corners;
    found = found || (boxes_[k].intersects(around) &&
                      segment_intersects_triangle(
                          a, b, {corner(t[0], fraction), corner(t[1], fraction), corner(t[2], fraction)}));
  });
  return found;
}

Vec3 ClothObstacles::displacement(const Hit& hit) const {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    const uint32_t point = triangles_[hit.triangle].corners[k];
    sum += hit.weights[static_cast<Eigen::Index>(k)] * (to_[point] - from_[point]);
  }
  return (1 - hit.fraction) * sum;
}

Vec3 ClothObstacles::carried(const Hit& hit) const {
  const Triangle& t = triangles_[hit.triangle].corners;
  const Vec3 before = normal_of(corner(t[0], hit.fraction), corner(t[1], hit.fraction),
                                corner(t[2], hit.fraction)),
             after = normal_of(to_[t[0]], to_[t[1]], to_[t[2]]);
  const Quat turn = Quat::FromTwoVectors(before, after);
  return hit.position - hit.distance * hit.normal + displacement(hit) + hit.distance * (turn * hit.normal);
}

template <class F>
void ClothObstacles::for_each_holder(const Hit& hit, F&& f) const {
  if (holders_.empty()) return;
  const Triangle& corners = triangles_[hit.triangle].corners;
  const auto holder = [&](std::size_t k) { return holder_[corners[k]]; };
  for (std::size_t k = 0; k < 3; ++k) {
    if (holder(k) == kNone || (k > 0 && holder(k) == holder(0)) || (k == 2 && holder(k) == holder(1)))
      continue;
    const Vec3 centre = holders_[holder(k)].body.centre_at(hit.fraction);
    PointVelocity at = PointVelocity::Zero();
    for (std::size_t i = k; i < 3; ++i)
      if (holder(i) == holder(k))
        at += hit.weights[static_cast<Eigen::Index>(i)] *
              point_velocity(corner(corners[i], hit.fraction) - centre);
    f(Share{holder(k), at});
  }
}

Vec3 ClothObstacles::velocity(const Hit& hit) const {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < 3; ++k)
    sum += hit.weights[static_cast<Eigen::Index>(k)] * velocity_[triangles_[hit.triangle].corners[k]];
  for_each_holder(hit, [&](const Share& s) { sum += s.at * impulses_->gained(holders_[s.holder].body); });
  return sum;
}

Real ClothObstacles::mobility_of_free_corners(const Hit& hit) const {
  Real sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Real weight = hit.weights[static_cast<Eigen::Index>(k)];
    sum += weight * weight * inverse_mass_[triangles_[hit.triangle].corners[k]];
  }
  return sum;
}

bool ClothObstacles::is_held(const Hit& hit) const {
  return std::ranges::any_of(triangles_[hit.triangle].corners,
                             [&](uint32_t point) { return holder_[point] != kNone; });
}

/// The holder carries the mass of all its points.
Mat6 ClothObstacles::holder_mobility(const Holder& holder, const Vec6& push) const {
  const Mat6 own = impulses_->mobility(holder.body, push);
  return (Mat6::Identity() + own * holder.carried).partialPivLu().solve(own);
}

Vec3 ClothObstacles::impulse(const Hit& hit, const Vec3& u, const Collider& particle) const {
  const Real friction = std::sqrt(particle.friction * cloths_[triangles_[hit.triangle].cloth].friction);
  const Real free = 1 / particle.mass + mobility_of_free_corners(hit);
  if (!is_held(hit)) return collision_impulse(1 / free, u, hit.normal, particle.restitution, friction);
  Mat3 K = free * Mat3::Identity();
  for_each_holder(hit, [&](const Share& s) {
    K += s.at * holder_mobility(holders_[s.holder], Vec6(-s.at.transpose() * hit.normal)) * s.at.transpose();
  });
  const ContactFrame f = contact_frame(hit.normal);
  Mat3 axes;
  axes << f.n, f.t, f.k;
  return axes * collision_impulse(Mat3(axes.transpose() * K * axes), Vec3(axes.transpose() * u),
                                  particle.restitution, friction, friction);
}

ClothObstacles::Impact ClothObstacles::collide(const Hit& hit, const Vec3& v, const Collider& particle,
                                               Real gain) {
  const Vec3 u = v - velocity(hit);
  const Real approach = -u.dot(hit.normal);
  const Real restitution = 2 * particle.restitution * approach < gain ? 0 : particle.restitution;
  Impact impact{.strikes = approach > std::max(gain, 0.0), .bounces = restitution > 0};
  cloths_[triangles_[hit.triangle].cloth].hits += impact.strikes;
  if (!(approach > 0)) return impact;
  impact.impulse = impulse(hit, u, {particle.mass, restitution, particle.friction});
  push(hit, -impact.impulse);
  return impact;
}

void ClothObstacles::push(const Hit& hit, const Vec3& impulse) {
  for (std::size_t k = 0; k < 3; ++k) {
    const uint32_t point = triangles_[hit.triangle].corners[k];
    velocity_[point] += hit.weights[static_cast<Eigen::Index>(k)] * inverse_mass_[point] * impulse;
  }
  for_each_holder(hit, [&](const Share& s) {
    Holder& holder = holders_[s.holder];
    const Vec6 all = s.at.transpose() * impulse, change = holder_mobility(holder, all) * all;
    const Vec6 own = all - holder.carried * change;
    if (!holder.carried.isZero(0)) holder.gained += change;
    impulses_->push({holder.body.body, own.head<3>(), own.tail<3>()});
  });
}

void ClothObstacles::finish() {
  for (std::size_t i = 0; i < holder_.size(); ++i) {
    if (holder_[i] == kNone) continue;
    const Holder& holder = holders_[holder_[i]];
    velocity_[i] += point_velocity(to_[i] - holder.body.centre_at(1)) * holder.gained;
  }
}

std::span<const Vec3> ClothObstacles::velocities(std::size_t cloth) const {
  const std::size_t end = cloth + 1 < cloths_.size() ? cloths_[cloth + 1].first : velocity_.size();
  return std::span(velocity_).subspan(cloths_[cloth].first, end - cloths_[cloth].first);
}

}  // namespace offstage::sim
