#include <algorithm>
#include <optional>

#include "sim/cloth/cloth_integrators.h"
#include "sim/cloth/spring_run.h"

namespace offstage::sim {
namespace {

/// Up to this value of the square of the step times the fastest frequency of bending, damping included,
/// bending is stable as an explicit force.
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
    // Called once for the whole sub-step.
    bending.add_damped_forces(cloth.part(points.start), cloth.part(points.velocity), force_);
  }
  bool is_stiff() const { return is_stiff_; }

  /// Adds the effect of a step to the moves, and to the `pin_impulse` of pinned points.
  void apply(ClothPoints& points, std::span<Vec4> moves) {
    if (is_stiff_) {
      std::fill(force_.begin(), force_.end(), Vec4::Zero());
      cloth_.bending.add_forces(cloth_.part(points.start), 1, force_);
    }
    give(points, moves);
  }

  /// Removes the motion that stiff bending does not allow; returns whether the tolerance was reached.
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
  void give(ClothPoints& points, std::span<Vec4> moves) const {
    for (std::size_t i = 0; i < force_.size(); ++i) {
      const std::size_t k = cloth_.begin + i;
      const Vec4 impulse = h_ * h_ * force_[i];
      is_held(points, k) ? points.pin_impulse[k] += impulse : moves[k] += points.inverse_mass[k] * impulse;
    }
  }

  const ClothRange& cloth_;
  Real damping_, h_;
  bool is_stiff_;
  SpringRun force_;
};

}  // namespace

bool step_relaxed(ClothPoints& points, const ClothRange& cloth, ClothSprings& springs, uint32_t steps,
                  Real dt, std::span<Vec4> kick) {
  const Real h = dt / steps;
  const std::size_t n = cloth.end - cloth.begin;
  SpringRun from(n), velocity(n);  // velocity times the step
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t k = cloth.begin + i;
    from[i] = points.start[k];
    velocity[i] = is_held(points, k) ? Vec4((points.position[k] - points.start[k]) / steps)
                                     : Vec4(h * points.velocity[k]);
  }
  const bool bends = !cloth.bending.empty();
  std::optional<RelaxedBending> bending;
  if (bends) bending.emplace(points, cloth, dt, h);
  std::vector<Vec4>& moves = points.moves;
  const bool drags = !cloth.air.empty();
  if (drags) cloth.air.begin(h);
  springs.begin(points, h);
  bool solved = true;
  for (uint32_t step = 0; step < steps; ++step) {
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t k = cloth.begin + i;
      moves[k] = is_held(points, k) ? velocity[i] : Vec4(velocity[i] + h * h * points.acceleration[k]);
      if (drags && !is_held(points, k)) moves[k] += h * h * cloth.air.change(i, velocity[i] / h);
    }
    if (bends) bending->apply(points, moves);
    springs.apply(points, moves);
    for (std::size_t i = 0; drags && i < n; ++i)
      if (Vec4& move = moves[cloth.begin + i]; !is_held(points, cloth.begin + i))
        move = velocity[i] + cloth.air.respond(i, move - velocity[i]);
    if (bends && bending->is_stiff()) solved &= bending->filter(points, moves);
    springs.relax(points, moves);
    for (std::size_t i = 0; i < n; ++i) {
      velocity[i] = moves[cloth.begin + i];
      points.start[cloth.begin + i] += velocity[i];
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t k = cloth.begin + i;
    if (is_held(points, k)) {
      points.pin_impulse[k] *= steps;  // impulses times the whole sub-step
    } else {
      points.position[k] = points.start[k];
      if (steps > 1) kick[k] = velocity[i] / h - (points.position[k] - from[i]) / dt;
    }
    points.start[k] = from[i];
  }
  return solved;
}

}  // namespace offstage::sim
