#pragma once
/// Private to the batches of contact patches (patch_batch.h): the motions of the bodies of eight patches,
/// their relative motion, and wrenches on them.

#include <array>
#include <span>

#include "sim/contact/patch_batch.h"
#include "sim/contact/patch_friction.h"

namespace offstage::sim {

struct LaneTwist {
  PatchVector linear, angular;
};

/// Transposes the matrix of four rows in each half of the registers. Returns its first three columns.
inline PatchVector columns(FloatLanes a, FloatLanes b, FloatLanes c, FloatLanes d) {
  const FloatLanes low_ab = _mm256_unpacklo_ps(a, b), low_cd = _mm256_unpacklo_ps(c, d);
  const FloatLanes high_ab = _mm256_unpackhi_ps(a, b), high_cd = _mm256_unpackhi_ps(c, d);
  return {_mm256_shuffle_ps(low_ab, low_cd, 0x44), _mm256_shuffle_ps(low_ab, low_cd, 0xEE),
          _mm256_shuffle_ps(high_ab, high_cd, 0x44)};
}
/// Inverts columns(). The last column is 0.
inline std::array<FloatLanes, 4> rows(const PatchVector& v) {
  const FloatLanes zero{};
  const FloatLanes low_xy = _mm256_unpacklo_ps(v.x, v.y), low_z = _mm256_unpacklo_ps(v.z, zero);
  const FloatLanes high_xy = _mm256_unpackhi_ps(v.x, v.y), high_z = _mm256_unpackhi_ps(v.z, zero);
  return {_mm256_shuffle_ps(low_xy, low_z, 0x44), _mm256_shuffle_ps(low_xy, low_z, 0xEE),
          _mm256_shuffle_ps(high_xy, high_z, 0x44), _mm256_shuffle_ps(high_xy, high_z, 0xEE)};
}
/// Returns a register with the first halves of both registers. second_halves() returns the second halves.
inline FloatLanes first_halves(FloatLanes a, FloatLanes b) {
  return _mm256_permute2f128_ps(a, b, 0x20);
}
inline FloatLanes second_halves(FloatLanes a, FloatLanes b) {
  return _mm256_permute2f128_ps(a, b, 0x31);
}

template <FloatLanes BodyMotion::*kWhat>
inline LaneTwist gather(std::span<const BodyMotion> motions, const PatchBatch::Index& i) {
  const auto linear = [&](unsigned k) {
    return first_halves(motions[i[k]].*kWhat, motions[i[k + 4]].*kWhat);
  };
  const auto angular = [&](unsigned k) {
    return second_halves(motions[i[k]].*kWhat, motions[i[k + 4]].*kWhat);
  };
  return {columns(linear(0), linear(1), linear(2), linear(3)),
          columns(angular(0), angular(1), angular(2), angular(3))};
}

/// Bodies that contacts do not move are not written, because other threads may read them.
template <FloatLanes BodyMotion::*kWhat>
inline void scatter(const LaneTwist& v, std::span<BodyMotion> motions, const PatchBatch::Index& i,
                    const std::array<bool, ContactColoring::kLanes>& moves) {
  const std::array<FloatLanes, 4> linear = rows(v.linear), angular = rows(v.angular);
  for (unsigned k = 0; k < 4; ++k) {
    if (moves[k]) motions[i[k]].*kWhat = first_halves(linear[k], angular[k]);
    if (moves[k + 4]) motions[i[k + 4]].*kWhat = second_halves(linear[k], angular[k]);
  }
}

/// Returns the relative velocity at the centre of each patch [m/s].
inline PatchVector relative_velocity(const PatchBatch& p, const LaneTwist& a, const LaneTwist& b) {
  return a.linear + cross(a.angular, p.arm_a) - b.linear - cross(b.angular, p.arm_b);
}

inline PatchGroups relative(const PatchBatch& p, const LaneTwist& a, const LaneTwist& b) {
  const PatchVector linear = relative_velocity(p, a, b);
  const PatchVector angular = a.angular - b.angular;
  return {{dot(p.n, linear), dot(p.t, angular), dot(p.k, angular)},
          {dot(p.t, linear), dot(p.k, linear), dot(p.n, angular)}};
}

/// point_part() returns the normal velocity of a point, from the normal group of a twist. point_wrench()
/// returns the wrench of a normal impulse at the point.
inline FloatLanes point_part(const PatchBatch::Point& q, const PatchVector& normal) {
  return normal.x + q.y * normal.y - q.x * normal.z;
}
inline PatchVector point_wrench(const PatchBatch::Point& q, FloatLanes impulse) {
  return {impulse, q.y * impulse, -q.x * impulse};
}

inline void apply(const PatchBatch& p, const PatchGroups& wrench, LaneTwist& a, LaneTwist& b) {
  const auto &f = wrench.normal, &g = wrench.friction;
  const PatchVector force = f.x * p.n + g.x * p.t + g.y * p.k;
  const PatchVector torque = g.z * p.n + f.y * p.t + f.z * p.k;
  a.linear = a.linear + p.inverse_mass_a * force;
  a.angular = a.angular + p.inverse_inertia_a * (cross(p.arm_a, force) + torque);
  b.linear = b.linear - p.inverse_mass_b * force;
  b.angular = b.angular - p.inverse_inertia_b * (cross(p.arm_b, force) + torque);
}

/// Whether the patches have one point each and no torques.
inline bool is_single(const PatchBatch& p) {
  return p.count == 1 && !p.resists_turning;
}

inline PatchSymmetric inverse(const PatchSymmetric& m) {
  const FloatLanes xx = m.yy * m.zz - m.yz * m.yz, xy = m.xz * m.yz - m.xy * m.zz,
                   xz = m.xy * m.yz - m.xz * m.yy;
  const FloatLanes scale = lane_inverse(m.xx * xx + m.xy * xy + m.xz * xz);
  return {scale * xx,
          scale * xy,
          scale * xz,
          scale * (m.xx * m.zz - m.xz * m.xz),
          scale * (m.xy * m.xz - m.xx * m.yz),
          scale * (m.xx * m.yy - m.xy * m.xy)};
}

}  // namespace offstage::sim
