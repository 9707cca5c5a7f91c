#include "sim/cloth/cloth_integrators.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace offstage::sim {
namespace {

constexpr int kMaxIterations = 300;
/// Of the residual against the right side, in the preconditioner's norm, squared.
constexpr Real kTolerance2 = 1e-12;
/// Of a step squared times the square of the fastest frequency of bending, damping included: up to this,
/// bending is as stable as an explicit force.
constexpr Real kSoftBending = 0.25;

using SpringRun = std::vector<Vec4>;

bool is_held(const ClothPoints& points, std::size_t i) {
  return !(points.inverse_mass[i] > 0);
}

/// Velocity of what is held through the sub-step.
Vec4 held_velocity(const ClothPoints& points, std::size_t i, Real h) {
  return (points.position[i] - points.start[i]) / h;
}

/// Accelerations at positions and velocities of a run; 0 of what is held.
void accelerate(const ClothPoints& points, const ClothRange& cloth, const SpringRun& x, const SpringRun& v,
                SpringRun& a) {
  std::fill(a.begin(), a.end(), Vec4::Zero());
  if (!cloth.bending.empty()) {
    cloth.bending.add_forces(x, 1, a);
    if (cloth.bending.damping() > 0) cloth.bending.multiply(v, -cloth.bending.damping(), a);
  }
  for (const ClothSpring& s : cloth.springs) {
    const std::size_t i = s.a - cloth.begin, j = s.b - cloth.begin;
    const Vec4 d = x[i] - x[j];
    const Real length = d.norm();
    if (!(length > 0)) continue;
    const Vec4 u = d / length;
    const Vec4 force =
        (s.stiffness * s.elongation(length, x, cloth.begin) + s.damping * u.dot(v[i] - v[j])) * u;
    a[i] -= force;
    a[j] += force;
  }
  for (std::size_t i = 0; i < a.size(); ++i) {
    const std::size_t k = cloth.begin + i;
    a[i] = is_held(points, k) ? Vec4(Vec4::Zero())
                              : Vec4(points.inverse_mass[k] * a[i] + points.acceleration[k]);
  }
}

/// Velocities gained in a step h of a run that began with v, with the drag of the gain implicit.
void drag_gains(const ClothRange& cloth, const SpringRun& v, Real h, SpringRun& gain) {
  if (cloth.air.empty()) return;
  cloth.air.begin(h);
  for (std::size_t i = 0; i < v.size(); ++i)
    gain[i] = cloth.air.respond(i, gain[i] + h * cloth.air.change(i, v[i]));
}

/// What springs do to what is held, over the time h.
void pass_on(ClothPoints& points, const ClothRange& cloth, const SpringRun& x, const SpringRun& v, Real h,
             Real dt) {
  if (!cloth.bending.empty()) {
    SpringRun force(x.size(), Vec4::Zero());
    cloth.bending.add_forces(x, 1, force);
    if (cloth.bending.damping() > 0) cloth.bending.multiply(v, -cloth.bending.damping(), force);
    for (std::size_t i = 0; i < force.size(); ++i)
      if (is_held(points, cloth.begin + i)) points.pull[cloth.begin + i] += h * dt * force[i];
  }
  for (const ClothSpring& s : cloth.springs) {
    const bool a = is_held(points, s.a), b = is_held(points, s.b);
    if (a == b) continue;
    const Vec4 d = x[s.a - cloth.begin] - x[s.b - cloth.begin];
    const Real length = d.norm();
    if (!(length > 0)) continue;
    const Vec4 u = d / length;
    const Vec4 impulse = h * dt *
                         (s.stiffness * s.elongation(length, x, cloth.begin) +
                          s.damping * u.dot(v[s.a - cloth.begin] - v[s.b - cloth.begin])) *
                         u;
    a ? points.pull[s.a] -= impulse : points.pull[s.b] += impulse;
  }
}

/// Where a run starts, with the velocity of what is held.
void begin(const ClothPoints& points, const ClothRange& cloth, Real h, SpringRun& x, SpringRun& v) {
  x.assign(points.start.begin() + static_cast<std::ptrdiff_t>(cloth.begin),
           points.start.begin() + static_cast<std::ptrdiff_t>(cloth.end));
  v.resize(x.size());
  for (std::size_t i = 0; i < v.size(); ++i) {
    const std::size_t k = cloth.begin + i;
    v[i] = is_held(points, k) ? held_velocity(points, k, h) : points.velocity[k];
  }
}

/// The matrix of backward Euler: of each spring alpha u u^T + beta 1 between its ends, that of bending, and
/// the masses.
class ImplicitSystem {
 public:
  ImplicitSystem(const ClothPoints& points, const ClothRange& cloth, Real h)
      : points_(points),
        cloth_(cloth),
        bending_(cloth.bending.empty() ? 0 : h * (h + cloth.bending.damping())) {
    block_.assign(cloth.end - cloth.begin, Mat3::Zero());
    for (std::size_t i = 0; i < block_.size(); ++i)
      block_[i].diagonal().setConstant(
          points.mass[cloth.begin + i] +
          (bending_ > 0 ? bending_ * cloth.bending.diagonal(static_cast<uint32_t>(i)) : 0));
    if (!cloth.air.empty()) {
      for (std::size_t i = 0; i < block_.size(); ++i) {
        drag_.push_back(h * points.mass[cloth.begin + i] * cloth.air.resistance(i));
        block_[i] += drag_[i];
      }
    }
    for (const ClothSpring& s : cloth.springs) {
      const Vec4 d = points.start[s.a] - points.start[s.b];
      const Real length = d.norm();
      const Vec4 u = length > 0 ? Vec4(d / length) : Vec4(Vec4::Zero());
      const Real elongation = s.elongation(length, points.start);
      const Real sideways = elongation > 0 ? elongation / length : 0;
      const Real stiff = h * h * s.stiffness;
      const Link link{u, stiff * (1 - sideways) + h * s.damping, stiff * sideways, s.stiffness * elongation};
      links_.push_back(link);
      const Mat3 k = link.along * u.head<3>() * u.head<3>().transpose() + link.across * Mat3::Identity();
      block_[s.a - cloth.begin] += k;
      block_[s.b - cloth.begin] += k;
    }
    for (Mat3& b : block_) b = b.inverse().eval();
  }

  /// y = A p, 0 where held.
  void multiply(const SpringRun& p, SpringRun& y) const {
    for (std::size_t i = 0; i < p.size(); ++i) y[i] = points_.mass[cloth_.begin + i] * p[i];
    for (std::size_t i = 0; i < drag_.size(); ++i) y[i] += dragged(i, p[i]);
    for (std::size_t k = 0; k < links_.size(); ++k) {
      const ClothSpring& s = cloth_.springs[k];
      const Link& link = links_[k];
      const std::size_t a = s.a - cloth_.begin, b = s.b - cloth_.begin;
      const Vec4 q = p[a] - p[b];
      const Vec4 f = link.along * link.direction.dot(q) * link.direction + link.across * q;
      y[a] += f;
      y[b] -= f;
    }
    if (bending_ > 0) cloth_.bending.multiply(p, bending_, y);
    clear_held(y);
  }

  /// What the springs do to what is held, when all move with v through the step.
  void pass_on(ClothPoints& points, const SpringRun& v, Real h) const {
    if (bending_ > 0) {
      SpringRun force(v.size(), Vec4::Zero());
      cloth_.bending.add_forces(cloth_.part(points.start), h * h, force);
      cloth_.bending.multiply(v, -h * bending_, force);
      for (std::size_t i = 0; i < force.size(); ++i)
        if (is_held(points, cloth_.begin + i)) points.pull[cloth_.begin + i] += force[i];
    }
    for (std::size_t k = 0; k < links_.size(); ++k) {
      const ClothSpring& s = cloth_.springs[k];
      const Link& link = links_[k];
      const Vec4 q = v[s.a - cloth_.begin] - v[s.b - cloth_.begin];
      const Vec4 impulse =
          h * ((h * link.force + link.along * link.direction.dot(q)) * link.direction + link.across * q);
      if (is_held(points, s.a)) points.pull[s.a] -= impulse;
      if (is_held(points, s.b)) points.pull[s.b] += impulse;
    }
  }

  void precondition(const SpringRun& r, SpringRun& z) const {
    for (std::size_t i = 0; i < r.size(); ++i) z[i] = padded(block_[i] * r[i].head<3>());
  }

  /// Impulse of the linear part of the drag on point i at a velocity.
  Vec4 dragged(std::size_t i, const Vec4& v) const {
    return drag_.empty() ? Vec4(Vec4::Zero()) : padded(drag_[i] * v.head<3>());
  }

  /// M v + h (spring forces + M a), 0 where held; drag is that of its velocity, with what is linear added.
  SpringRun right_side(const SpringRun& v, Real h) const {
    SpringRun b(v.size());
    for (std::size_t i = 0; i < b.size(); ++i) {
      const std::size_t k = cloth_.begin + i;
      b[i] = points_.mass[k] * (v[i] + h * points_.acceleration[k]);
    }
    for (std::size_t i = 0; i < drag_.size(); ++i) b[i] += dragged(i, cloth_.air.from(i));
    for (std::size_t k = 0; k < links_.size(); ++k) {
      const Vec4 f = h * links_[k].force * links_[k].direction;
      b[cloth_.springs[k].a - cloth_.begin] -= f;
      b[cloth_.springs[k].b - cloth_.begin] += f;
    }
    if (bending_ > 0) cloth_.bending.add_forces(cloth_.part(points_.start), h, b);
    clear_held(b);
    return b;
  }

 private:
  struct Link {
    Vec4 direction;
    Real along, across, force;
  };

  void clear_held(SpringRun& y) const {
    for (std::size_t i = 0; i < y.size(); ++i)
      if (is_held(points_, cloth_.begin + i)) y[i].setZero();
  }

  const ClothPoints& points_;
  const ClothRange& cloth_;
  Real bending_;  // factor of its matrix
  std::vector<Link> links_;
  std::vector<Mat3> block_;  // inverse
  std::vector<Mat3> drag_;   // of each point; none without air
};

Real dot(const SpringRun& a, const SpringRun& b) {
  Real sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

/// Preconditioned conjugate gradients from a guess v, whose held points keep it.
bool solve(const ImplicitSystem& system, const SpringRun& b, SpringRun& v) {
  SpringRun r(v.size()), z(v.size()), y(v.size());
  system.multiply(v, y);
  for (std::size_t i = 0; i < r.size(); ++i) r[i] = b[i] - y[i];
  system.precondition(b, z);
  const Real enough = kTolerance2 * dot(b, z);
  system.precondition(r, z);
  SpringRun p = z;
  Real rz = dot(r, z);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    if (!(rz > enough)) return true;
    system.multiply(p, y);
    const Real step = rz / dot(p, y);
    for (std::size_t i = 0; i < v.size(); ++i) {
      v[i] += step * p[i];
      r[i] -= step * y[i];
    }
    system.precondition(r, z);
    const Real next = dot(r, z);
    for (std::size_t i = 0; i < p.size(); ++i) p[i] = z[i] + next / rz * p[i];
    rz = next;
  }
  return false;
}

/// What the solution left of the momentum of a cloth that nothing holds, is given to all of it.
void keep_momentum(const ClothPoints& points, const ClothRange& cloth, const ImplicitSystem& system,
                   const SpringRun& b, SpringRun& v) {
  Vec4 lost = Vec4::Zero();
  Real mass = 0;
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (is_held(points, cloth.begin + i)) return;
    lost += b[i] - points.mass[cloth.begin + i] * v[i] - system.dragged(i, v[i]);
    mass += points.mass[cloth.begin + i];
  }
  for (Vec4& velocity : v) velocity += lost / mass;
}

/// Bending in a sub-step of step_relaxed().
class RelaxedBending {
 public:
  RelaxedBending(const ClothPoints& points, const ClothRange& cloth, Real dt, Real h)
      : cloth_(cloth), damping_(cloth.bending.damping()), h_(h) {
    ClothBending& bending = cloth.bending;
    is_stiff_ = dt * (dt + damping_) * bending.fastest() > kSoftBending;
    force_.assign(cloth.end - cloth.begin, Vec4::Zero());
    if (is_stiff_) return;
    // Once for the whole sub-step.
    bending.add_damped_forces(cloth.part(points.start), cloth.part(points.velocity), force_);
  }
  bool is_stiff() const { return is_stiff_; }

  /// Adds what it does in a step to the moves, and to the pull of what is held.
  void pull(ClothPoints& points, std::span<Vec4> moves) {
    if (is_stiff_) {
      std::fill(force_.begin(), force_.end(), Vec4::Zero());
      cloth_.bending.add_forces(cloth_.part(points.start), 1, force_);
    }
    give(points, moves);
  }

  /// Takes out of the moves what stiff bending does not allow; whether to tolerance.
  bool filter(ClothPoints& points, std::span<Vec4> moves) {
    const Real stiff = h_ * (h_ + damping_);
    const std::span<Vec4> own = moves.subspan(cloth_.begin, force_.size());
    const bool done =
        cloth_.bending.filter(cloth_.part(points.mass), cloth_.part(points.inverse_mass), stiff, own);
    std::fill(force_.begin(), force_.end(), Vec4::Zero());
    cloth_.bending.multiply(own, -stiff, force_);
    for (std::size_t i = 0; i < force_.size(); ++i)
      if (is_held(points, cloth_.begin + i)) points.pull[cloth_.begin + i] += force_[i];
    return done;
  }

 private:
  void give(ClothPoints& points, std::span<Vec4> moves) const {
    for (std::size_t i = 0; i < force_.size(); ++i) {
      const std::size_t k = cloth_.begin + i;
      const Vec4 impulse = h_ * h_ * force_[i];
      is_held(points, k) ? points.pull[k] += impulse : moves[k] += points.inverse_mass[k] * impulse;
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
    if (bends) bending->pull(points, moves);
    springs.pull(points, moves);
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
      points.pull[k] *= steps;  // impulses times the whole sub-step
    } else {
      points.position[k] = points.start[k];
      if (steps > 1) kick[k] = velocity[i] / h - (points.position[k] - from[i]) / dt;
    }
    points.start[k] = from[i];
  }
  return solved;
}

void step_symplectic(ClothPoints& points, const ClothRange& cloth, Real h) {
  SpringRun x, v;
  begin(points, cloth, h, x, v);
  SpringRun a(x.size());
  accelerate(points, cloth, x, v, a);
  pass_on(points, cloth, x, v, h, h);
  for (Vec4& gain : a) gain *= h;
  drag_gains(cloth, v, h, a);
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!is_held(points, cloth.begin + i)) points.position[cloth.begin + i] = x[i] + h * (v[i] + a[i]);
}

void step_rk4(ClothPoints& points, const ClothRange& cloth, Real h, std::span<Vec4> kick) {
  SpringRun x, v;
  begin(points, cloth, h, x, v);
  const std::size_t n = x.size();
  const std::array<Real, 4> at = {0, h / 2, h / 2, h}, share = {h / 6, h / 3, h / 3, h / 6};
  SpringRun dx(v), dv(n, Vec4::Zero()), stage_x(n), stage_v(n), move(n, Vec4::Zero()), gain(n, Vec4::Zero());
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t i = 0; i < n; ++i) {
      stage_x[i] = x[i] + at[k] * dx[i];
      stage_v[i] = v[i] + at[k] * dv[i];
    }
    accelerate(points, cloth, stage_x, stage_v, dv);
    pass_on(points, cloth, stage_x, stage_v, share[k], h);
    dx = stage_v;
    for (std::size_t i = 0; i < n; ++i) {
      move[i] += share[k] * dx[i];
      gain[i] += share[k] * dv[i];
    }
  }
  const SpringRun free = gain;
  drag_gains(cloth, v, h, gain);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t k = cloth.begin + i;
    if (is_held(points, k)) continue;
    move[i] += h / 2 * (gain[i] - free[i]);
    points.position[k] = x[i] + move[i];
    kick[k] = v[i] + gain[i] - move[i] / h;
  }
}

bool step_implicit(ClothPoints& points, const ClothRange& cloth, Real h) {
  SpringRun x, v;
  begin(points, cloth, h, x, v);
  const ImplicitSystem system(points, cloth, h);
  const SpringRun b = system.right_side(v, h);
  const bool converged = solve(system, b, v);
  keep_momentum(points, cloth, system, b, v);
  system.pass_on(points, v, h);
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!is_held(points, cloth.begin + i)) points.position[cloth.begin + i] = x[i] + h * v[i];
  return converged;
}

}  // namespace offstage::sim
