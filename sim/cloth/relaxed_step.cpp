#include <algorithm>
#include <optional>
#include <utility>

#include "sim/cloth/cloth_integrators.h"
#include "sim/cloth/pinned_bodies.h"
#include "sim/cloth/spring_run.h"
#include "sim/cloth/support_bodies.h"

namespace offstage::sim {
namespace {

/// Greatest square of the time for which an explicit force of bending is constant, times the square of the
/// fastest frequency, damping included. The limit of stability is 2 or more.
constexpr Real kSoftBending = 1;

/// Bending in a sub-step of step_relaxed(). If a step of the springs is short enough for an explicit force,
/// the force is computed at the start of as many steps as stability permits, and constant in these.
/// Otherwise each step has an implicit force.
class RelaxedBending {
 public:
  RelaxedBending(const ClothPoints& points, const ClothRange& cloth, uint32_t steps, Real h)
      : cloth_(cloth), damping_(cloth.bending.damping()), h_(h), steps_(steps) {
    ClothBending& bending = cloth.bending;
    // A force a that is constant in n steps of length h moves a point by n (n + 1) / 2 h^2 a, and not by
    // (n h)^2 a as a single step of symplectic Euler. Therefore the area in the phase plane grows by the
    // fraction n (n - 1) / 2 h^2 omega^2. The damping n h tau omega^2 must be at least as large.
    const auto is_soft = [&](uint32_t count) {
      const Real length = count * h;
      return 2 * damping_ >= (count - 1) * h &&
             length * (length + damping_) * bending.fastest() <= kSoftBending;
    };
    while (steps_ > 0 && !is_soft(steps_)) --steps_;
    is_steady_ = steps_ == steps;
    for (std::size_t i = cloth.begin; i < cloth.end; ++i)
      if (is_held(points, i)) held_.push_back(i - cloth.begin);
    force_.assign(cloth.end - cloth.begin, Vec4::Zero());
    if (is_steady_)
      bending.add_damped_forces(cloth.part(points.start), cloth.part(points.velocity), 1, force_);
  }
  bool is_implicit() const { return steps_ == 0; }
  /// Whether the force is constant in the whole sub-step; steady_gain() contains it then.
  bool is_steady() const { return is_steady_; }

  /// Returns the change of a point's move by a force that is constant in all steps; 0 for pinned points.
  Vec4 steady_gain(const ClothPoints& points, std::size_t i) const {
    return h_ * h_ * points.inverse_mass[cloth_.begin + i] * force_[i];
  }
  /// Adds the impulses of bending in a step to `pin_impulse` for pinned points. For other points it adds the
  /// effect of bending to the moves, unless steady_gain() contains it.
  void apply(ClothPoints& points, uint32_t step, std::span<Vec4> moves) {
    if (!is_steady_) compute(points, step);
    for (std::size_t i : held_) points.pin_impulse[cloth_.begin + i] += h_ * h_ * force_[i];
    for (std::size_t i = 0; !is_steady_ && i < force_.size(); ++i)
      moves[cloth_.begin + i] += h_ * h_ * points.inverse_mass[cloth_.begin + i] * force_[i];
  }

  /// Damps the part of the moves that bending resists, for an implicit step. Returns whether the tolerance
  /// was reached.
  bool filter(ClothPoints& points, std::span<Vec4> moves) {
    const Real stiff = h_ * (h_ + damping_);
    const std::span<Vec4> own = moves.subspan(cloth_.begin, force_.size());
    const bool done =
        cloth_.bending.filter(cloth_.part(points.mass), cloth_.part(points.inverse_mass), stiff, own);
    std::fill(force_.begin(), force_.end(), Vec4::Zero());
    cloth_.bending.multiply(own, -stiff, force_);
    for (std::size_t i : held_) points.pin_impulse[cloth_.begin + i] += force_[i];
    return done;
  }

 private:
  /// Computes the force at the start of a step, if it changes there. filter() adds the damping of an implicit
  /// step.
  void compute(const ClothPoints& points, uint32_t step) {
    if (!is_implicit() && step % steps_ != 0) return;
    std::fill(force_.begin(), force_.end(), Vec4::Zero());
    if (is_implicit())
      cloth_.bending.add_forces(cloth_.part(points.start), 1, force_);
    else
      cloth_.bending.add_damped_forces(cloth_.part(points.start), cloth_.part(points.step_velocity), 1 / h_,
                                       force_);
  }

  const ClothRange& cloth_;
  Real damping_, h_;
  uint32_t steps_;  // number of steps in which a force is constant; 0: implicit
  bool is_steady_;
  SpringRun force_;
  std::vector<std::size_t> held_;  // pinned points
};

/// The pressure of gas in a sub-step of step_relaxed(). It is computed in each step of the springs, which
/// balance most of it.
class RelaxedGas {
 public:
  RelaxedGas(const ClothPoints& points, const ClothRange& cloth, Real h) : cloth_(cloth), h_(h) {
    if (!cloth.gas.acts()) return;
    force_.resize(cloth.end - cloth.begin);
    for (std::size_t i = 0; i < force_.size(); ++i)
      if (is_held(points, cloth.begin + i)) held_.push_back(i);
  }
  /// Adds the effect of the gas in a step to the moves, and its impulses on pinned points to `pin_impulse`.
  void apply(ClothPoints& points, std::span<Vec4> moves) {
    if (force_.empty()) return;
    std::fill(force_.begin(), force_.end(), Vec4::Zero());
    cloth_.gas.add_forces(cloth_.part(points.start), h_ * h_, force_);
    for (std::size_t i : held_) points.pin_impulse[cloth_.begin + i] += force_[i];
    for (std::size_t i = 0; i < force_.size(); ++i)
      moves[cloth_.begin + i] += points.inverse_mass[cloth_.begin + i] * force_[i];
  }

 private:
  const ClothRange& cloth_;
  Real h_;
  SpringRun force_;                // times h^2 [kg m]
  std::vector<std::size_t> held_;  // pinned points
};

/// The supports of a cloth in a sub-step of step_relaxed().
class RelaxedSupports {
 public:
  RelaxedSupports(ClothPoints& points, const ClothRange& cloth, uint32_t steps, Real h)
      : points_(points),
        supports_(cloth.supports(points)),
        of_triangles_(cloth.triangle_supports(points)),
        bodies_(points, supports_, of_triangles_, h),
        steps_(steps) {}

  void begin_step(uint32_t step) {
    part_ = (step + 1.0) / steps_;
    for (Support& s : supports_) s.impulse = 0;
    for (Support& s : of_triangles_) s.impulse = 0;
  }
  /// Keeps supported points and triangles above their planes in the current step. The impulses of the step so
  /// far may also become smaller, so that a point can leave its support. Supports of the same dynamic body or
  /// point depend on each other, so the order is reversed each time.
  void hold_up() {
    is_reverse_ = !is_reverse_;
    const std::size_t count = supports_.size() + of_triangles_.size();
    for (std::size_t n = 0; n < count; ++n) {
      const std::size_t k = is_reverse_ ? count - 1 - n : n;
      k < supports_.size() ? hold_up_point(k) : hold_up_triangle(k);
    }
  }
  void end_step() {
    for (std::size_t k = 0; k < supports_.size(); ++k) {
      Vec4& move = points_.moves[supports_[k].point];
      move += bodies_.apply_friction(k, supports_[k], 1.0 / steps_, move);
    }
    for (std::size_t n = 0; n < of_triangles_.size(); ++n) {
      const std::size_t k = supports_.size() + n;
      const TriangleSupport& s = of_triangles_[n];
      const Vec4 move = s.sum([&](uint32_t i) -> const Vec4& { return points_.moves[i]; });
      push(s, bodies_.point_mass(k) * bodies_.apply_friction(k, s, 1.0 / steps_, move));
    }
    bodies_.advance();
  }
  void end() { bodies_.apply(); }

 private:
  void hold_up_point(std::size_t k) {
    Support& s = supports_[k];
    points_.moves[s.point] += points_.inverse_mass[s.point] * impulse_on(k, s, moved(s.point));
  }
  void hold_up_triangle(std::size_t k) {
    TriangleSupport& s = of_triangles_[k - supports_.size()];
    push(s, impulse_on(k, s, s.sum([&](uint32_t i) { return moved(i); })));
  }
  Vec4 moved(uint32_t i) const { return points_.start[i] - points_.step_start[i] + points_.moves[i]; }
  /// Applies the impulse that keeps a point above its support k, and the opposite one to the body. Returns
  /// the impulse on the point.
  Vec4 impulse_on(std::size_t k, Support& s, const Vec4& moved) {
    const Real lacks = s.least(part_) + bodies_.displacement(k, s) - s.normal.dot(moved);
    const Real impulse = std::max(s.impulse + bodies_.effective_mass(k) * lacks, 0.0);
    const Vec4 change = (impulse - s.impulse) * s.normal;
    bodies_.push(k, -change);
    s.impulse = impulse;
    return change;
  }
  /// Distributes an impulse over the corners of a triangle.
  void push(const TriangleSupport& s, const Vec4& impulse) {
    for (std::size_t k = 0; k < 3; ++k) {
      const uint32_t i = s.corners[k];
      if (is_held(points_, i))
        points_.pin_impulse[i] += s.weights[k] * impulse;
      else
        points_.moves[i] += points_.inverse_mass[i] * s.weights[k] * impulse;
    }
  }

  ClothPoints& points_;
  std::span<Support> supports_;
  std::span<TriangleSupport> of_triangles_;
  SupportBodies bodies_;
  Real part_ = 0;  // end of the current step as a fraction of the sub-step
  uint32_t steps_;
  bool is_reverse_ = true;
};

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
  if (bends) bending.emplace(points, cloth, steps, h);
  RelaxedGas gas(points, cloth, h);
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
    if (bends && bending->is_steady()) gain[i] += bending->steady_gain(points, i);
    coast(i, held(i) ? Vec4((points.position[k] - x[i]) / steps) : Vec4(h * points.velocity[k]));
  }
  bool solved = true;
  RelaxedSupports supports(points, cloth, steps, h);
  PinnedBodies pinned(points, cloth, steps, h);
  for (uint32_t step = 0; step < steps; ++step) {
    supports.begin_step(step);
    pinned.begin_step(points);
    if (bends) bending->apply(points, step, points.moves);
    gas.apply(points, points.moves);
    springs.apply(points, points.moves);
    for (std::size_t i = 0; drags && i < n; ++i)
      if (!held(i)) moves[i] = velocity[i] + cloth.air.respond(i, moves[i] - velocity[i]);
    if (bends && bending->is_implicit()) solved &= bending->filter(points, points.moves);
    supports.hold_up();
    springs.relax(points, points.moves, [&] { supports.hold_up(); });
    if (cloth.bend_limit) {
      bend_limit.apply(h, points.moves);
      supports.hold_up();
    }
    supports.end_step();
    pinned.end_step(points, step);
    for (std::size_t i = 0; i < n; ++i) {
      const Vec4 move = moves[i];
      x[i] += move;
      coast(i, move);
    }
  }
  supports.end();
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
