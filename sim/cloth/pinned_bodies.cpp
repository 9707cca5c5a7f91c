#include "sim/cloth/pinned_bodies.h"

#include <algorithm>
#include <cmath>

#include "sim/linear/mobility_root.h"

namespace offstage::sim {
namespace {

/// Greatest h^2 times the square of the fastest frequency of a body on the springs at its pins, damping
/// included. The limit of stability is 4, because a body moves by the impulses at the start of a step.
constexpr Real kMostPull = 1;

/// Stiffness and damping of the springs at the pins of a body, for its [displacement, rotation].
struct PinStiffness {
  Mat6 stiffness = Mat6::Zero(), damping = Mat6::Zero();
};

Real greatest_eigenvalue(const Mat6& root, const Mat6& of) {
  const Mat6 product = root.transpose() * of * root;
  return std::max(Eigen::SelfAdjointEigenSolver<Mat6>(product, Eigen::EigenvaluesOnly).eigenvalues()[5], 0.0);
}

}  // namespace

PinnedBodies::PinnedBodies(const ClothPoints& points, const ClothRange& cloth, uint32_t steps, Real h)
    : steps_(steps), h_(h) {
  for (Carrier& carrier : cloth.carriers) {
    Holder holder{&carrier, Mat6::Zero(), Vec6::Zero(), {}, {}, {}, {}};
    for (uint32_t i : carrier.points) {
      if (i < cloth.begin || i >= cloth.end) continue;
      holder.points.push_back(i);
      holder.arms.emplace_back(points.at(i) - carrier.body->centre());
      holder.path.emplace_back((points.position[i] - points.start[i]) / steps);
      holder.taken.push_back(points.pin_impulse[i]);
    }
    if (holder.points.empty()) continue;
    holder.mobility = carrier.body->mobility(carrier.carried(points));
    holder.gained = holder.mobility * (carrier.inertia + carrier.early);
    holders_.push_back(std::move(holder));
  }
}

void PinnedBodies::begin_step(ClothPoints& points) const {
  for (const Holder& holder : holders_)
    for (std::size_t k = 0; k < holder.points.size(); ++k) {
      const uint32_t i = holder.points[k];
      points.moves[i] = holder.path[k] + padded(h_ * point_velocity(holder.arms[k]) * holder.gained);
      points.step_velocity[i] = points.moves[i];
    }
}

void PinnedBodies::end_step(ClothPoints& points, uint32_t step) {
  for (Holder& holder : holders_) {
    Vec6 sum = Vec6::Zero();
    for (std::size_t k = 0; k < holder.points.size(); ++k) {
      const Vec4& all = points.pin_impulse[holder.points[k]];
      const Vec3 impulse = (all - holder.taken[k]).head<3>() / h_;
      holder.taken[k] = all;
      sum += stacked(impulse, holder.arms[k].cross(impulse));
    }
    const Vec6 change = holder.mobility * sum;
    holder.gained += change;
    // An impulse displaces the body in this step and the following ones.
    holder.carrier->early += static_cast<Real>(steps_ - step) / steps_ * sum;
    for (std::size_t k = 0; k < holder.points.size(); ++k)
      points.moves[holder.points[k]] += padded(h_ * point_velocity(holder.arms[k]) * change);
  }
}

Real longest_pin_step(const ClothPoints& points, std::span<const ClothSpring> springs,
                      std::span<const Carrier> carriers) {
  if (carriers.empty()) return kInfinity;
  std::vector<PinStiffness> pins(carriers.size());
  const auto add = [&](uint32_t end, const ClothSpring& s, Real share) {
    const auto at = std::ranges::find(carriers, points.holder[end], &Carrier::body);
    const ClothBody& body = *at->body;
    const Vec3 centre = body.obstacle().start.point_to_world(body.obstacle().centre);
    const Vec3 d = (points.position[s.a] - points.position[s.b]).head<3>();
    const Real length = d.norm();
    if (!(length > 0)) return;
    const Vec3 u = d / length;
    const Mat3 along = u * u.transpose();
    const Real across = std::max(1 - s.rest_length / length, 0.0);
    const Eigen::Matrix<Real, 3, 6> E = point_velocity(points.at(end) - centre);
    PinStiffness& sum = pins[static_cast<std::size_t>(at - carriers.begin())];
    sum.stiffness += share * s.stiffness * E.transpose() * (along + across * (Mat3::Identity() - along)) * E;
    sum.damping += share * s.damping * E.transpose() * along * E;
  };
  for (const ClothSpring& s : springs) {
    const bool a = points.carried[s.a], b = points.carried[s.b];
    if ((!a && !b) || (a && b && points.holder[s.a] == points.holder[s.b])) continue;
    // Both bodies move the ends of a spring between them.
    if (a) add(s.a, s, b ? 2 : 1);
    if (b) add(s.b, s, a ? 2 : 1);
  }
  Real longest = kInfinity;
  for (std::size_t k = 0; k < carriers.size(); ++k) {
    if (pins[k].stiffness.isZero(0)) continue;
    const ClothBody& body = *carriers[k].body;
    const Vec3 centre = body.obstacle().start.point_to_world(body.obstacle().centre);
    const Mat6 own = body.free_mobility(), carried = carriers[k].carried(points, centre);
    const Mat6 root = mobility_root((Mat6::Identity() + own * carried).partialPivLu().solve(own));
    const Real omega2 = greatest_eigenvalue(root, pins[k].stiffness);
    const Real delta = greatest_eigenvalue(root, pins[k].damping);
    longest = std::min(longest, 2 * kMostPull / (delta + std::sqrt(delta * delta + 4 * kMostPull * omega2)));
  }
  return longest;
}

}  // namespace offstage::sim
