#pragma once
/// Friction of contact patches in SIMD lanes, for the sweeps of the fast solver (patch_batch.h).

#include <algorithm>
#include <array>
#include <utility>

#include "sim/contact/patch_batch.h"

namespace offstage::sim {

using PatchVector = PatchBatch::Vector;
using PatchSymmetric = PatchBatch::Symmetric;

/// Smaller sliding speeds of points are replaced by this one, to avoid division by zero [m/s].
inline constexpr float kSlowestSliding = 1e-6F;

/// Returns the sum of a patch's normal impulses.
inline FloatLanes pressure(const PatchBatch& p) {
  FloatLanes sum{};
  for (uint32_t i = 0; i < p.count; ++i) sum += p.points[i].impulse;
  return sum;
}

/// Returns Coulomb's limits of the impulses along t and k [N s], and of the angular impulse about n [N m s].
/// The latter assumes that every point's friction is perpendicular to its arm from the centre.
inline PatchVector friction_limits(const PatchBatch& p) {
  FloatLanes force{}, moment{};
  for (uint32_t i = 0; i < p.count; ++i) {
    const PatchBatch::Point& q = p.points[i];
    force += q.impulse;
    moment += q.impulse * q.radius;
  }
  return {p.friction_t * force, p.friction_k * force, lane_min(p.friction_t, p.friction_k) * moment};
}

/// Projects impulses along t and k onto the friction limits: a disc if the coefficients of both axes are
/// equal, otherwise a rectangle.
inline std::pair<FloatLanes, FloatLanes> projected(const PatchBatch& p, FloatLanes t, FloatLanes k,
                                                   const PatchVector& limits) {
  const FloatLanes size = lane_sqrt(t * t + k * k);
  const FloatLanes scale = size > limits.x ? limits.x / size : float_lanes(1);
  const auto round = p.friction_t == p.friction_k;
  return {round ? scale * t : lane_clamp(t, limits.x), round ? scale * k : lane_clamp(k, limits.y)};
}

/// Returns the friction impulses along t and k of a patch with a single point, for the relative velocity u.
/// If the impulses that stop the sliding are within the limits, they are the result. Otherwise the result is
/// a projected gradient step: a step against the velocity, short enough for convergence, projected onto the
/// limits. At its fixed point friction is exactly opposite to the sliding velocity.
inline PatchVector coulomb_impulse(const PatchBatch& p, const PatchVector& u, const PatchVector& limits) {
  const PatchSymmetric& S = p.friction_stiffness;
  const PatchVector& old = p.friction_impulse;
  const FloatLanes stick_t = old.x - (S.xx * u.x + S.xy * u.y);
  const FloatLanes stick_k = old.y - (S.xy * u.x + S.yy * u.y);
  const auto [held_t, held_k] = projected(p, old.x - S.zz * u.x, old.y - S.zz * u.y, limits);
  const auto round = p.friction_t == p.friction_k;
  const auto sticks = round ? stick_t * stick_t + stick_k * stick_k <= limits.x * limits.x
                            : (lane_abs(stick_t) <= limits.x) & (lane_abs(stick_k) <= limits.y);
  return {sticks ? stick_t : held_t, sticks ? stick_k : held_k, FloatLanes{}};
}

/// Returns the solution x of A x = b for a positive definite A.
inline PatchVector solution_of(const PatchSymmetric& A, const PatchVector& b) {
  const FloatLanes first = lane_inverse(A.xx), y_x = first * A.xy, z_x = first * A.xz;
  const FloatLanes yy = A.yy - y_x * A.xy, yz = A.yz - y_x * A.xz;
  const FloatLanes second = lane_inverse(yy), z_y = second * yz;
  const FloatLanes third = lane_inverse(A.zz - z_x * A.xz - z_y * yz);
  const FloatLanes b_y = b.y - y_x * b.x, b_z = b.z - z_x * b.x - z_y * b_y;
  const FloatLanes z = third * b_z, y = second * b_y - z_y * z;
  return {first * b.x - y_x * y - z_x * z, y, z};
}

/// Returns the friction impulses of a patch with separate limits for sliding and spinning: first against
/// sliding, then against spinning.
inline PatchVector separate_impulse(const PatchBatch& p, const PatchVector& u, const PatchVector& limits) {
  const PatchSymmetric& K = p.friction_mobility;
  const PatchVector& old = p.friction_impulse;
  const FloatLanes step = lane_inverse(lane_max(K.xx, K.yy) + lane_abs(K.xy));
  const auto [held_t, held_k] = projected(p, old.x - step * u.x, old.y - step * u.y, limits);
  const FloatLanes spin = u.z + K.xz * (held_t - old.x) + K.yz * (held_k - old.y);
  return {held_t, held_k, lane_clamp(old.z - lane_inverse(K.zz) * spin, limits.z)};
}

/// Returns the friction of a patch that slides or spins with the relative `twist`. Each point has Coulomb
/// friction against its own velocity, so sliding reduces the friction against spin and vice versa. The
/// friction of a point is linearized as viscous friction with the coefficient limit / speed, which gives one
/// linear system per patch. The speeds of the points are evaluated after separate_impulse(), which is exact
/// without spin. `kIsotropic`: friction_t equals friction_k in all lanes, which takes fewer operations.
/// `kSpins`: points have spinning friction, treated as sliding at the distance spin_arm. With a friction
/// axis, spinning has a separate limit.
template <bool kIsotropic, bool kSpins>
PatchVector sliding_impulse(const PatchBatch& p, const PatchVector& twist, const PatchVector& limits) {
  std::array<FloatLanes, 4> viscous_t, viscous_k, viscous_n;
  const auto round = p.friction_t == p.friction_k;
  const FloatLanes slowest = float_lanes(kSlowestSliding);
  const auto at = [&p](uint32_t i, const PatchVector& v) {
    const PatchBatch::Point& q = p.points[i];
    return std::pair(v.x - q.y * v.z, v.y + q.x * v.z);
  };
  PatchSymmetric A = p.friction_stiffness;
  const PatchVector u =
      twist + p.friction_mobility * (separate_impulse(p, twist, limits) - p.friction_impulse);
  for (uint32_t i = 0; i < p.count; ++i) {
    const PatchBatch::Point& q = p.points[i];
    const auto [t, k] = at(i, u);
    const FloatLanes turning = kSpins ? p.spin_arm * u.z : FloatLanes{};
    const FloatLanes speed = kSpins ? lane_sqrt(t * t + k * k + turning * turning) : lane_sqrt(t * t + k * k);
    if constexpr (kIsotropic) {
      viscous_t[i] = viscous_k[i] = q.impulse * p.friction_t / lane_max(speed, slowest);
    } else {
      viscous_t[i] = q.impulse * p.friction_t / lane_max(round ? speed : lane_abs(t), slowest);
      viscous_k[i] = q.impulse * p.friction_k / lane_max(round ? speed : lane_abs(k), slowest);
    }
    const FloatLanes x = viscous_k[i] * q.x, y = viscous_t[i] * q.y;
    A.xx += viscous_t[i];
    A.xz -= y;
    A.yy += viscous_k[i];
    A.yz += x;
    A.zz += x * q.x + y * q.y;
    if constexpr (kSpins) {
      const FloatLanes separate =
          q.impulse * lane_min(p.friction_t, p.friction_k) / lane_max(lane_abs(turning), slowest);
      viscous_n[i] = round ? viscous_t[i] : separate;
      A.zz += viscous_n[i] * p.spin_arm * p.spin_arm;
    }
  }
  const PatchVector next = solution_of(A, p.friction_stiffness * twist - p.friction_impulse);
  PatchVector impulse{};
  for (uint32_t i = 0; i < p.count; ++i) {
    const PatchBatch::Point& q = p.points[i];
    const auto [t, k] = at(i, next);
    FloatLanes f = viscous_t[i] * t, g = viscous_k[i] * k;
    // A component whose speed increased is clamped to its limit.
    const FloatLanes limit_t = q.impulse * p.friction_t, limit_k = q.impulse * p.friction_k;
    FloatLanes h = kSpins ? viscous_n[i] * p.spin_arm * next.z : FloatLanes{};
    const FloatLanes size = kSpins ? lane_sqrt(f * f + g * g + h * h) : lane_sqrt(f * f + g * g);
    const FloatLanes scale = size > limit_t ? limit_t / size : float_lanes(1);
    if constexpr (kSpins) h = round ? scale * h : lane_clamp(h, lane_min(limit_t, limit_k));
    if constexpr (kIsotropic) {
      f *= scale;
      g *= scale;
    } else {
      f = round ? scale * f : lane_clamp(f, limit_t);
      g = round ? scale * g : lane_clamp(g, limit_k);
    }
    FloatLanes moment = q.x * g - q.y * f;
    if constexpr (kSpins) moment += p.spin_arm * h;
    impulse = impulse - PatchVector{f, g, moment};
  }
  return impulse;
}

/// Returns the rolling friction of a patch, about t and k in y and z. It is the angular impulse that stops
/// the rolling if that is within the disc, else a projected gradient step as in coulomb_impulse(). Where the
/// patch sticks, its friction follows a change of the rolling: a ball rolls about the contact with the
/// inertia I + m r^2, and not with I. The stopping impulse takes that into account. (With I alone, solving
/// rolling and friction in turn would leave 5/7 of the error.)
inline PatchVector rolling_impulse(const PatchBatch& p, const PatchVector& u) {
  const FloatLanes zero{};
  const PatchSymmetric& K = p.normal_mobility;
  const PatchVector t{p.coupling.x.y, p.coupling.y.y, p.coupling.z.y},
      k{p.coupling.x.z, p.coupling.y.z, p.coupling.z.z};
  const PatchVector St = p.friction_stiffness * t, Sk = p.friction_stiffness * k;
  const FloatLanes sticks = p.pressure > zero ? zero : float_lanes(1);
  // The mobility that remains for rolling while the friction sticks. It is a Schur complement and therefore
  // positive.
  const FloatLanes yy = K.yy - sticks * dot(t, St), yz = K.yz - sticks * dot(t, Sk),
                   zz = K.zz - sticks * dot(k, Sk);
  const FloatLanes scale = lane_inverse(yy * zz - yz * yz);
  const FloatLanes stop_y = p.rolling_impulse.y - scale * (zz * u.y - yz * u.z),
                   stop_z = p.rolling_impulse.z - scale * (yy * u.z - yz * u.y);
  const FloatLanes step = lane_inverse(lane_max(K.yy, K.zz) + lane_abs(K.yz));
  const FloatLanes y = p.rolling_impulse.y - step * u.y, z = p.rolling_impulse.z - step * u.z;
  const FloatLanes limit = p.rolling * pressure(p), size = lane_sqrt(y * y + z * z);
  const FloatLanes fraction = size > limit ? limit / size : float_lanes(1);
  const auto stops = stop_y * stop_y + stop_z * stop_z <= limit * limit;
  const auto resists = p.rolling > zero;
  return {zero, resists ? (stops ? stop_y : fraction * y) : zero,
          resists ? (stops ? stop_z : fraction * z) : zero};
}

}  // namespace offstage::sim
