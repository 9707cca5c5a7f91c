#include "sim/cloth/bend_limit.h"

#include <algorithm>
#include <cmath>

namespace offstage::sim {
namespace {

/// Patches above this fraction of the limit are part of the system, because impulses on other patches may
/// bend them too far.
constexpr Real kNearBendLimit = 0.8;
/// Sweeps end when none changes a curvature by more than this fraction of the limit, or after this number of
/// sweeps.
constexpr Real kBendTolerance = 1e-4;
constexpr int kMaxBendSweeps = 60;
/// Fraction of its excess that a patch keeps if it exceeded the limit already at the start of the sub-step.
/// The limit does not consider springs: in the next sub-step they would undo a full correction, and the cloth
/// would vibrate.
constexpr Real kKeepsOfExcess = 0.5;

}  // namespace

bool BendLimit::project(ClothPoints& points, Real dt, std::span<const Vec4> kick,
                        std::vector<VelocityCut>& cuts) {
  if (!find_rows(points)) {
    before_.clear();
    return false;
  }
  solve(points);
  before_.assign(bending_->patch_count(), 0);
  for (const Row& row : rows_) before_[row.patch] = row.impulse;
  apply(points, dt, kick, cuts);
  return acted_ = true;
}

Real BendLimit::greatest(const ClothPoints& points) const {
  Real curvature = 0;
  for (std::size_t k = 0; k < bending_->patch_count(); ++k)
    curvature = std::max(curvature, bending_->curvature(k, part(points.position)));
  return radius_ * curvature;
}

/// Collects the patches near the limit; returns whether any patch exceeds it.
bool BendLimit::find_rows(const ClothPoints& points) {
  rows_.clear();
  gradient_.clear();
  bool any = false;
  const std::span<const Vec4> x = part(points.position);
  for (std::size_t k = 0; k < bending_->patch_count(); ++k) {
    const Real bend = radius_ * bending_->curvature(k, x);
    if (!(bend > kNearBendLimit)) continue;
    const std::size_t first = gradient_.size();
    bending_->add_gradient(k, x, gradient_);
    Real compliance = 0;
    for (std::size_t i = first; i < gradient_.size(); ++i) {
      gradient_[i].second *= radius_;
      compliance += points.inverse_mass[first_ + gradient_[i].first] * gradient_[i].second.squaredNorm();
    }
    if (!(compliance > 0)) {
      gradient_.resize(first);
      continue;
    }
    const Real start = radius_ * bending_->curvature(k, part(points.start));
    const Real excess = bend - 1 - kKeepsOfExcess * std::max(start - 1, 0.0);
    rows_.push_back({k, first, gradient_.size(), excess, compliance, before_.empty() ? 0 : before_[k]});
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

/// Solves for the impulses of all rows. The impulses of the last sub-step are the initial guess.
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

/// Moves the points by the impulses. The velocities change by the greatest fraction of the moves that adds no
/// kinetic energy. So the correction of a patch that was bent too far before gives the cloth no velocity.
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
  const Real fraction = inertial > 0 ? std::clamp(-2 * work / inertial, 0.0, 1.0) : 1;
  for (std::size_t i = 0; i < count_; ++i) {
    const auto k = static_cast<uint32_t>(first_ + i);
    if (points.inverse_mass[k] == 0) {
      points.pin_impulse[k] += fraction * move_[i];
      continue;
    }
    points.position[k] += move_[i];
    if (fraction < 1 && !move_[i].isZero(0)) cuts.push_back({k, (1 - fraction) * move_[i]});
  }
}

}  // namespace offstage::sim
