#include <algorithm>
#include <optional>
#include <utility>

#include "sim/cloth/cloth_integrators.h"
#include "sim/cloth/spring_run.h"

namespace offstage::sim {
namespace {

/// Bending is stable as an explicit force if the square of the step times the fastest frequency, damping
/// included, is at most this.
constexpr Real kSoftBending = 0.25;

/// Bending in a sub-step of step_relaxed().
class RelaxedBending {
 public:
  RelaxedBending(const ClothPoints& points, const ClothRange& cloth, Real dt, Real h)
      : cloth_(cloth), damping_(cloth.bending.damping()), h_(h) {
    ClothBending& bending = cloth.bending;
    is_stiff_ = dt * (dt + damping_) * bending.fastest() > kSoftBending;
    force_.assign(cloth.end - cloth.begin, Vec4::Zero());
    if (is_stiff_) return;
    // The damped force is computed once for the whole sub-step.
    bending.add_damped_forces(cloth.part(points.start), cloth.part(points.velocity), force_);
  }
  bool is_stiff() const { return is_stiff_; }

  /// Returns the change of a point's move by bending that is not stiff; 0 for pinned points. It is equal in
  /// all steps.
  Vec4 steady_gain(const ClothPoints& points, std::size_t i) const {
    return h_ * h_ * points.inverse_mass[cloth_.begin + i] * force_[i];
  }
  /// Adds the impulses of bending in a step to `pin_impulse` for pinned points. For other points it adds the
  /// effect of stiff bending to the moves.
  void apply(ClothPoints& points, std::span<Vec4> moves) {
    if (is_stiff_) {
      std::fill(force_.begin(), force_.end(), Vec4::Zero());
      cloth_.bending.add_forces(cloth_.part(points.start), 1, force_);
    }
    for (std::size_t i = 0; i < force_.size(); ++i) {
      const std::size_t k = cloth_.begin + i;
      if (is_held(points, k))
        points.pin_impulse[k] += h_ * h_ * force_[i];
      else if (is_stiff_)
        moves[k] += h_ * h_ * points.inverse_mass[k] * force_[i];
    }
  }

  /// Damps the part of the moves that stiff bending resists. Returns whether the tolerance was reached.
  bool filter(ClothPoints& points, std::span<Vec4> moves) {
    const Real stiff = h_ * (h_ + damping_);
    const std::span<Vec4> own = moves.subspan(cloth_.begin, force_.size());
    const bool done =
        cloth_.bending.filter(cloth_.part(points.mass), cloth_.part(points.inverse_mass), stiff, own);
    std::fill(force_.begin(), force_.end(), Vec4::Zero());
    cloth_.bending.multiply(own, -stiff, force_);
    for (std::size_t i = 0; i < force_.size(); ++i)
      if (is_held(points, cloth_.begin + i)) points.pin_impulse[cloth_.begin + i] += force_[i];
    return done;
  }

 private:
  const ClothRange& cloth_;
  Real damping_, h_;
  bool is_stiff_;
  SpringRun force_;
};

/// Keeps supported points above their planes in a step that ends after the fraction `part` of the sub-step.
/// The impulses of the step so far may also become smaller, so that a point can leave its support.
void hold_up(const ClothPoints& points, std::span<Support> supports, Real part, std::span<Vec4> moves) {
  for (Support& s : supports) {
    const Vec4 moved = points.start[s.point] - points.step_start[s.point] + moves[s.point];
    const Real lacks = points.mass[s.point] * (s.least(part) - s.normal.dot(moved));
    const Real impulse = std::max(s.impulse + lacks, 0.0);
    moves[s.point] += points.inverse_mass[s.point] * (impulse - s.impulse) * s.normal;
    s.impulse = impulse;
  }
}

/// The smallest radius of bending in a sub-step of step_relaxed(). It acts in each step of the springs:
/// moves across an arc stretch it, and in a long step stiff springs would gain more than motion loses.
class RelaxedBendLimit {
 public:
  RelaxedBendLimit(ClothPoints& points, const ClothRange& cloth) : points_(points), cloth_(cloth) {
    if (!cloth.bend_limit) return;
    still_.assign(points.size(), Vec4::Zero());
    const std::span<const Vec4> own = cloth_.part(std::as_const(points.position));
    ends_.assign(own.begin(), own.end());
  }

  /// Moves the points as the limit wants it in a step of length h. Displacements that must not count as
  /// velocity are added to ClothPoints::start, the others to `moves`.
  void apply(Real h, std::span<Vec4> moves) {
    if (!cloth_.bend_limit) return;
    for (std::size_t k = cloth_.begin; k < cloth_.end; ++k) points_.position[k] = points_.start[k] + moves[k];
    cuts_.clear();
    if (!cloth_.bend_limit->project(points_, h, still_, cuts_)) return;
    for (std::size_t k = cloth_.begin; k < cloth_.end; ++k)
      if (!is_held(points_, k)) moves[k] = points_.position[k] - points_.start[k];
    for (const VelocityCut& cut : cuts_) {
      points_.start[cut.point] += cut.move;
      moves[cut.point] -= cut.move;
    }
  }
  /// Puts pinned points to where the sub-step ends.
  void end() {
    for (std::size_t i = 0; i < ends_.size(); ++i)
      if (is_held(points_, cloth_.begin + i)) points_.position[cloth_.begin + i] = ends_[i];
  }

 private:
  ClothPoints& points_;
  const ClothRange& cloth_;
  std::vector<Vec4> still_, ends_;
  std::vector<VelocityCut> cuts_;
};

}  // namespace

bool step_relaxed(ClothPoints& points, const ClothRange& cloth, ClothSprings& springs, uint32_t steps,
                  Real dt, std::span<Vec4> kick) {
  const Real h = dt / steps;
  const std::size_t n = cloth.end - cloth.begin;
  const std::span<Vec4> x = cloth.part(points.start), moves = cloth.part(points.moves),
                        from = cloth.part(points.step_start), velocity = cloth.part(points.step_velocity),
                        gain = cloth.part(points.step_gain);  // velocity and its gain times the step
  const auto held = [&](std::size_t i) { return is_held(points, cloth.begin + i); };
  const bool bends = !cloth.bending.empty(), drags = !cloth.air.empty();
  std::optional<RelaxedBending> bending;
  if (bends) bending.emplace(points, cloth, dt, h);
  RelaxedBendLimit bend_limit(points, cloth);
  if (drags) cloth.air.begin(h);
  springs.begin(points, h);
  // Computes a point's move without springs. Its drag is taken at the velocity before the step.
  const auto coast = [&](std::size_t i, const Vec4& v) {
    velocity[i] = v;
    moves[i] = v + gain[i];
    if (drags && !held(i)) moves[i] -= h * cloth.air.resist(i, v);
  };
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t k = cloth.begin + i;
    from[i] = x[i];
    gain[i] = held(i) ? Vec4(Vec4::Zero()) : Vec4(h * h * points.acceleration[k]);
    if (drags && !held(i)) gain[i] += h * h * cloth.air.resist(i, cloth.air.from(i));
    if (bends && !bending->is_stiff()) gain[i] += bending->steady_gain(points, i);
    coast(i, held(i) ? Vec4((points.position[k] - x[i]) / steps) : Vec4(h * points.velocity[k]));
  }
  bool solved = true;
  const std::span<Support> supports = cloth.supports(points);
  for (uint32_t step = 0; step < steps; ++step) {
    const Real part = (step + 1.0) / steps;
    for (Support& s : supports) s.impulse = 0;
    if (bends) bending->apply(points, points.moves);
    springs.apply(points, points.moves);
    for (std::size_t i = 0; drags && i < n; ++i)
      if (!held(i)) moves[i] = velocity[i] + cloth.air.respond(i, moves[i] - velocity[i]);
    if (bends && bending->is_stiff()) solved &= bending->filter(points, points.moves);
    hold_up(points, supports, part, points.moves);
    springs.relax(points, points.moves, [&] { hold_up(points, supports, part, points.moves); });
    if (cloth.bend_limit) {
      bend_limit.apply(h, points.moves);
      hold_up(points, supports, part, points.moves);
    }
    for (Support& s : supports)
      points.moves[s.point] = s.rub(points.moves[s.point], 1.0 / steps, points.mass[s.point]);
    for (std::size_t i = 0; i < n; ++i) {
      const Vec4 move = moves[i];
      x[i] += move;
      coast(i, move);
    }
  }
  for (Support& s : supports) s.given *= steps;  // the sum of the impulses times the whole sub-step
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t k = cloth.begin + i;
    if (held(i)) {
      points.pin_impulse[k] *= steps;  // the sum of the impulses times the whole sub-step
    } else {
      points.position[k] = x[i];
      if (steps > 1 || cloth.bend_limit) kick[k] = velocity[i] / h - (x[i] - from[i]) / dt;
    }
    x[i] = from[i];
  }
  bend_limit.end();
  return solved;
}

}  // namespace offstage::sim
