#include "sim/cloth/bend_limit.h"

#include <algorithm>
#include <cmath>

namespace offstage::sim {
namespace {

/// Places from this share of the limit on may be bent too far by the impulses of others.
constexpr Real kNearBendLimit = 0.8;
/// Of the limit: sweeps end when none changes a curvature by more than this, or after so many.
constexpr Real kBendTolerance = 1e-4;
constexpr int kMaxBendSweeps = 60;
/// Share of a curvature beyond the limit that is taken back in a sub-step by moving points. It stretches
/// springs by an energy that grows with the square of the move: if all is taken back at once, strips that are
/// thrown together have up to 1.7 times their energy for some sub-steps.
constexpr Real kBendRecovery = 0.1;
/// A place that is bent less than this share of the limit has no reliable direction of bending yet.
constexpr Real kLeastBend = 0.3;

}  // namespace

void BendLimit::brace(ClothPoints& points, Real dt) {
  braced_.clear();
  ahead_.resize(count_);
  for (std::size_t i = 0; i < count_; ++i) {
    const std::size_t k = first_ + i;
    ahead_[i] = points.inverse_mass[k] == 0
                    ? points.position[k]
                    : Vec4(points.start[k] + dt * (points.velocity[k] + dt * points.acceleration[k]));
  }
  if (!find_rows_ahead(points)) return;
  solve(points);
  braced_.assign(count_, Vec4::Zero());
  for (std::size_t i = 0; i < count_; ++i)
    if (points.inverse_mass[first_ + i] == 0)
      braced_[i] = move_[i];
    else
      points.velocity[first_ + i] += move_[i] / dt;
}

bool BendLimit::project(ClothPoints& points, Real dt, std::span<const Vec4> kick,
                        std::vector<VelocityCut>& cuts) {
  for (std::size_t i = 0; i < braced_.size(); ++i) points.pull[first_ + i] += braced_[i];
  if (!find_rows(points)) {
    before_.clear();
    return false;
  }
  solve(points);
  before_.assign(bending_->patch_count(), 0);
  for (const Row& row : rows_) before_[row.patch] = row.impulse;
  apply(points, dt, kick, cuts);
  return true;
}

Real BendLimit::greatest(const ClothPoints& points) const {
  Real curvature = 0;
  for (std::size_t k = 0; k < bending_->patch_count(); ++k)
    curvature = std::max(curvature, bending_->curvature(k, part(points.position)));
  return radius_ * curvature;
}

/// Adds a row with the gradient at the given points; its excess is to be set. Whether impulses can bend it.
bool BendLimit::add_row(const ClothPoints& points, std::size_t patch, std::span<const Vec4> at,
                        Real impulse) {
  const std::size_t first = gradient_.size();
  bending_->add_gradient(patch, at, gradient_);
  Real compliance = 0;
  for (std::size_t i = first; i < gradient_.size(); ++i) {
    gradient_[i].second *= radius_;
    compliance += points.inverse_mass[first_ + gradient_[i].first] * gradient_[i].second.squaredNorm();
  }
  if (!(compliance > 0)) {
    gradient_.resize(first);
    return false;
  }
  rows_.push_back({patch, first, gradient_.size(), 0, compliance, impulse});
  return true;
}

/// The places that free motion bends to their limit or near it; whether any beyond it. Gradients are those at
/// the start, where the impulses act, so that these keep the angular momentum. No more is taken back than the
/// motion adds: a place that is bent too far at the start does not begin to move back.
bool BendLimit::find_rows_ahead(const ClothPoints& points) {
  rows_.clear();
  gradient_.clear();
  bool any = false;
  const std::span<const Vec4> start = part(points.start);
  for (std::size_t k = 0; k < bending_->patch_count(); ++k) {
    const Real bend = radius_ * bending_->curvature(k, ahead_);
    if (!(bend > kNearBendLimit)) continue;
    const Real before = radius_ * bending_->curvature(k, start);
    if (!(before > kLeastBend) || !add_row(points, k, start, 0)) continue;
    Row& row = rows_.back();
    Real added = 0;
    for (std::size_t i = row.first; i < row.end; ++i)
      added += gradient_[i].second.dot(ahead_[gradient_[i].first] - start[gradient_[i].first]);
    row.excess = std::min(bend - std::max(before, 1.0), added);
    any |= row.excess > 0;
  }
  return any;
}

/// The places near their limit at the end of the sub-step; whether any is beyond it.
bool BendLimit::find_rows(const ClothPoints& points) {
  rows_.clear();
  gradient_.clear();
  bool any = false;
  const std::span<const Vec4> x = part(points.position);
  for (std::size_t k = 0; k < bending_->patch_count(); ++k) {
    const Real bend = radius_ * bending_->curvature(k, x);
    if (!(bend > kNearBendLimit) || !add_row(points, k, x, before_.empty() ? 0 : before_[k])) continue;
    rows_.back().excess = (bend > 1 ? kBendRecovery : 1) * (bend - 1);
    any |= bend > 1;
  }
  return any;
}

void BendLimit::push(const ClothPoints& points, const Row& row, Real impulse) {
  for (std::size_t i = row.first; i < row.end; ++i) {
    const auto& [point, direction] = gradient_[i];
    const Real mobility = points.inverse_mass[first_ + point];
    move_[point] -= (mobility > 0 ? mobility * impulse : impulse) * direction;
  }
}

/// Begins with the impulses of the last sub-step.
void BendLimit::solve(const ClothPoints& points) {
  move_.assign(count_, Vec4::Zero());
  for (const Row& row : rows_)
    if (row.impulse > 0) push(points, row, row.impulse);
  Real change = 1;
  for (int sweep = 0; sweep < kMaxBendSweeps && change > kBendTolerance; ++sweep) {
    change = 0;
    for (Row& row : rows_) {
      Real left = row.excess;
      for (std::size_t i = row.first; i < row.end; ++i)
        if (const auto& [point, direction] = gradient_[i]; points.inverse_mass[first_ + point] > 0)
          left += direction.dot(move_[point]);
      const Real impulse = std::max(row.impulse + left / row.compliance, 0.0), more = impulse - row.impulse;
      if (more == 0) continue;
      row.impulse = impulse;
      push(points, row, more);
      change = std::max(change, std::abs(more) * row.compliance);
    }
  }
}

/// Moves the points by the impulses. Velocities change by the greatest share of them that adds no kinetic
/// energy: a place that was bent too far before is bent back without a speed.
void BendLimit::apply(ClothPoints& points, Real dt, std::span<const Vec4> kick,
                      std::vector<VelocityCut>& cuts) {
  std::vector<Vec4> cut(count_, Vec4::Zero());
  for (const VelocityCut& c : cuts)
    if (c.point >= first_ && c.point < first_ + count_) cut[c.point - first_] += c.move;
  Real work = 0, inertial = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const std::size_t k = first_ + i;
    const bool is_held = points.inverse_mass[k] == 0;
    const Vec4 impulse = is_held ? move_[i] : Vec4(points.mass[k] * move_[i]);
    work += impulse.dot(points.position[k] - points.start[k] + dt * kick[k] - cut[i]);
    if (!is_held) inertial += impulse.dot(move_[i]);
  }
  const Real share = inertial > 0 ? std::clamp(-2 * work / inertial, 0.0, 1.0) : 1;
  for (std::size_t i = 0; i < count_; ++i) {
    const auto k = static_cast<uint32_t>(first_ + i);
    if (points.inverse_mass[k] == 0) {
      points.pull[k] += share * move_[i];
      continue;
    }
    points.position[k] += move_[i];
    if (share < 1 && !move_[i].isZero(0)) cuts.push_back({k, (1 - share) * move_[i]});
  }
}

}  // namespace offstage::sim
