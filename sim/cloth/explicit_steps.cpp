#include <algorithm>
#include <array>

#include "sim/cloth/cloth_integrators.h"
#include "sim/cloth/spring_run.h"

namespace offstage::sim {
namespace {

/// Computes the accelerations of a cloth's points from positions and velocities; 0 for pinned points.
void accelerate(const ClothPoints& points, const ClothRange& cloth, const SpringRun& x, const SpringRun& v,
                SpringRun& a) {
  std::fill(a.begin(), a.end(), Vec4::Zero());
  if (!cloth.bending.empty()) {
    cloth.bending.add_forces(x, 1, a);
    if (cloth.bending.damping() > 0) cloth.bending.multiply(v, -cloth.bending.damping(), a);
  }
  if (cloth.gas.acts()) cloth.gas.add_forces(x, 1, a);
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

/// Applies drag to the velocities `gain` that a cloth gains in a step h from the velocities v. The drag of
/// the gain is implicit.
void drag_gains(const ClothRange& cloth, const SpringRun& v, Real h, SpringRun& gain) {
  if (cloth.air.empty()) return;
  cloth.air.begin(h);
  for (std::size_t i = 0; i < v.size(); ++i)
    gain[i] = cloth.air.respond(i, gain[i] + h * cloth.air.change(i, v[i]));
}

/// Adds the impulses that springs exert on pinned points within the time h.
void pass_on(ClothPoints& points, const ClothRange& cloth, const SpringRun& x, const SpringRun& v, Real h,
             Real dt) {
  if (!cloth.bending.empty() || cloth.gas.acts()) {
    SpringRun force(x.size(), Vec4::Zero());
    if (!cloth.bending.empty()) cloth.bending.add_forces(x, 1, force);
    if (cloth.bending.damping() > 0) cloth.bending.multiply(v, -cloth.bending.damping(), force);
    if (cloth.gas.acts()) cloth.gas.add_forces(x, 1, force);
    for (std::size_t i = 0; i < force.size(); ++i)
      if (is_held(points, cloth.begin + i)) points.pin_impulse[cloth.begin + i] += h * dt * force[i];
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
    a ? points.pin_impulse[s.a] -= impulse : points.pin_impulse[s.b] += impulse;
  }
}

}  // namespace

void step_symplectic(ClothPoints& points, const ClothRange& cloth, Real h) {
  SpringRun x, v;
  begin_run(points, cloth, h, x, v);
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
  begin_run(points, cloth, h, x, v);
  const std::size_t n = x.size();
  const std::array<Real, 4> at = {0, h / 2, h / 2, h}, fraction = {h / 6, h / 3, h / 3, h / 6};
  SpringRun dx(v), dv(n, Vec4::Zero()), stage_x(n), stage_v(n), move(n, Vec4::Zero()), gain(n, Vec4::Zero());
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t i = 0; i < n; ++i) {
      stage_x[i] = x[i] + at[k] * dx[i];
      stage_v[i] = v[i] + at[k] * dv[i];
    }
    accelerate(points, cloth, stage_x, stage_v, dv);
    pass_on(points, cloth, stage_x, stage_v, fraction[k], h);
    dx = stage_v;
    for (std::size_t i = 0; i < n; ++i) {
      move[i] += fraction[k] * dx[i];
      gain[i] += fraction[k] * dv[i];
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

}  // namespace offstage::sim
