#include "sim/contact/patch_batch.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <type_traits>
#include <utility>

#include "sim/contact/contact_coloring.h"
#include "sim/contact/patch_friction.h"
#include "sim/contact/relaxation.h"

namespace offstage::sim {
namespace {

/// A sweep solves a patch in rounds, until a round changes its velocities by less than this [m/s] or the
/// limit is reached. kSettled: a resting patch takes one round; an impact takes more, because otherwise some
/// points would penetrate. kSolved: a patch without an initial guess is solved completely at first, because
/// otherwise it would slip during the first sweeps. kAlone: no other patch moves these bodies, so no later
/// sweep corrects the remaining error; without more rounds the load would jump between the ends of a narrow
/// line of contact, and a coin on its rim would rock.
constexpr float kSettled = 0.01F, kAlone = 1e-5F, kSolved = 1e-6F;
constexpr uint32_t kPatchRounds = 20, kLoneRounds = 60;
uint32_t rounds(const PatchBatch& p) {
  return p.alone ? kLoneRounds : kPatchRounds;
}
float settled(const PatchBatch& p) {
  return p.alone ? kAlone : kSettled;
}

/// Each sub-step moves an impulse by the fraction kReturn of its difference from its running mean, and the
/// mean by the fraction kRenewal. Slow modes whose frequency is near kRenewal are damped most. The mean of a
/// patch without an initial guess is its impulse.
constexpr float kReturn = 0.03F, kRenewal = 0.01F;
/// Overlap of a link that push-out leaves [m]. Push-out lifts bodies without work. Where it removed the
/// overlaps of micrometres that the error of the sweeps causes, it replaced the energy that a car on soft
/// springs lost as it rocked on the edges of its wheels, and the car trembled at 2 mm/s for ever.
constexpr float kLinkOverlap = 1e-5F;
/// Friction sticks below the fraction kHolds of its limit, and slides above the fraction kSlides. Both are
/// fractions of squared values.
constexpr float kHolds = 0.96F, kSlides = 0.999F;
/// Greatest factor by which sliding friction follows a later increase of the normal impulses. A larger one
/// could reverse the sliding.
constexpr float kMostGrowth = 1.1F;
/// Lower bound of the coefficient of friction of contacts with spinning friction, which is relative to it.
constexpr Real kLeastFriction = 1e-4;

using Vector = PatchBatch::Vector;
using Symmetric = PatchBatch::Symmetric;
using Groups = PatchGroups;
constexpr unsigned kLanes = ContactColoring::kLanes;

struct LaneTwist {
  Vector linear, angular;
};

/// Transposes the matrix of four rows in each half of the registers. Returns its first three columns.
Vector columns(FloatLanes a, FloatLanes b, FloatLanes c, FloatLanes d) {
  const FloatLanes low_ab = _mm256_unpacklo_ps(a, b), low_cd = _mm256_unpacklo_ps(c, d);
  const FloatLanes high_ab = _mm256_unpackhi_ps(a, b), high_cd = _mm256_unpackhi_ps(c, d);
  return {_mm256_shuffle_ps(low_ab, low_cd, 0x44), _mm256_shuffle_ps(low_ab, low_cd, 0xEE),
          _mm256_shuffle_ps(high_ab, high_cd, 0x44)};
}
/// Inverts columns(). The last column is 0.
std::array<FloatLanes, 4> rows(const Vector& v) {
  const FloatLanes zero{};
  const FloatLanes low_xy = _mm256_unpacklo_ps(v.x, v.y), low_z = _mm256_unpacklo_ps(v.z, zero);
  const FloatLanes high_xy = _mm256_unpackhi_ps(v.x, v.y), high_z = _mm256_unpackhi_ps(v.z, zero);
  return {_mm256_shuffle_ps(low_xy, low_z, 0x44), _mm256_shuffle_ps(low_xy, low_z, 0xEE),
          _mm256_shuffle_ps(high_xy, high_z, 0x44), _mm256_shuffle_ps(high_xy, high_z, 0xEE)};
}
/// Returns a register with the first halves of both registers. second_halves() returns the second halves.
FloatLanes first_halves(FloatLanes a, FloatLanes b) {
  return _mm256_permute2f128_ps(a, b, 0x20);
}
FloatLanes second_halves(FloatLanes a, FloatLanes b) {
  return _mm256_permute2f128_ps(a, b, 0x31);
}

template <FloatLanes BodyMotion::*kWhat>
LaneTwist gather(std::span<const BodyMotion> motions, const PatchBatch::Index& i) {
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
void scatter(const LaneTwist& v, std::span<BodyMotion> motions, const PatchBatch::Index& i,
             const std::array<bool, kLanes>& moves) {
  const std::array<FloatLanes, 4> linear = rows(v.linear), angular = rows(v.angular);
  for (unsigned k = 0; k < 4; ++k) {
    if (moves[k]) motions[i[k]].*kWhat = first_halves(linear[k], angular[k]);
    if (moves[k + 4]) motions[i[k + 4]].*kWhat = second_halves(linear[k], angular[k]);
  }
}

/// Returns the relative velocity at the centre of each patch [m/s].
Vector relative_velocity(const PatchBatch& p, const LaneTwist& a, const LaneTwist& b) {
  return a.linear + cross(a.angular, p.arm_a) - b.linear - cross(b.angular, p.arm_b);
}

Groups relative(const PatchBatch& p, const LaneTwist& a, const LaneTwist& b) {
  const Vector linear = relative_velocity(p, a, b);
  const Vector angular = a.angular - b.angular;
  return {{dot(p.n, linear), dot(p.t, angular), dot(p.k, angular)},
          {dot(p.t, linear), dot(p.k, linear), dot(p.n, angular)}};
}

/// point_part() returns the normal velocity of a point, from the normal group of a twist. point_wrench()
/// returns the wrench of a normal impulse at the point.
FloatLanes point_part(const PatchBatch::Point& q, const Vector& normal) {
  return normal.x + q.y * normal.y - q.x * normal.z;
}
Vector point_wrench(const PatchBatch::Point& q, FloatLanes impulse) {
  return {impulse, q.y * impulse, -q.x * impulse};
}

void apply(const PatchBatch& p, const Groups& wrench, LaneTwist& a, LaneTwist& b) {
  const auto &f = wrench.normal, &g = wrench.friction;
  const Vector force = f.x * p.n + g.x * p.t + g.y * p.k;
  const Vector torque = g.z * p.n + f.y * p.t + f.z * p.k;
  a.linear = a.linear + p.inverse_mass_a * force;
  a.angular = a.angular + p.inverse_inertia_a * (cross(p.arm_a, force) + torque);
  b.linear = b.linear - p.inverse_mass_b * force;
  b.angular = b.angular - p.inverse_inertia_b * (cross(p.arm_b, force) + torque);
}

// Response of one body to a unit impulse, or angular impulse, along each axis. It gives the K of R6 for a
// patch.

struct Row {
  Vector linear, angular;  // the axis as a wrench about the centre of mass
  Vector turned;           // inverse inertia times `angular`
};

FloatLanes mobility(FloatLanes inverse_mass, const Row& i, const Row& j) {
  return inverse_mass * dot(i.linear, j.linear) + dot(i.angular, j.turned);
}

struct Mobility {
  Symmetric normal, friction;
  LaneMatrix<FloatLanes> coupling;
};

Mobility mobility(const PatchBatch& p, const Vector& arm, FloatLanes m, const Symmetric& I) {
  const auto force = [&](const Vector& axis) {
    const Vector moment = cross(arm, axis);
    return Row{axis, moment, I * moment};
  };
  const auto torque = [&](const Vector& axis) { return Row{Vector{}, axis, I * axis}; };
  const std::array<Row, 3> f = {force(p.n), torque(p.t), torque(p.k)};
  const std::array<Row, 3> g = {force(p.t), force(p.k), torque(p.n)};
  const auto symmetric = [m](const std::array<Row, 3>& r) {
    return Symmetric{mobility(m, r[0], r[0]), mobility(m, r[0], r[1]), mobility(m, r[0], r[2]),
                     mobility(m, r[1], r[1]), mobility(m, r[1], r[2]), mobility(m, r[2], r[2])};
  };
  const auto row = [&](const Row& r) {
    return Vector{mobility(m, r, f[0]), mobility(m, r, f[1]), mobility(m, r, f[2])};
  };
  return {symmetric(f), symmetric(g), {row(g[0]), row(g[1]), row(g[2])}};
}

/// Whether the patches have one point each and no torques.
bool is_single(const PatchBatch& p) {
  return p.count == 1 && !p.resists_turning;
}

void set_single_mobility(PatchBatch& p) {
  const Vector* const axes[] = {&p.n, &p.t, &p.k};
  const auto entry = [&](int i, int j) {
    const Vector &x = *axes[i], &y = *axes[j];
    return (p.inverse_mass_a + p.inverse_mass_b) * dot(x, y) +
           dot(cross(p.arm_a, x), p.inverse_inertia_a * cross(p.arm_a, y)) +
           dot(cross(p.arm_b, x), p.inverse_inertia_b * cross(p.arm_b, y));
  };
  p.normal_mobility.xx = entry(0, 0);
  p.friction_mobility.xx = entry(1, 1);
  p.friction_mobility.xy = entry(1, 2);
  p.friction_mobility.yy = entry(2, 2);
  p.coupling.x.x = entry(1, 0);
  p.coupling.y.x = entry(2, 0);
  p.points[0].mass *= lane_inverse(p.normal_mobility.xx);
}

void set_full_mobility(PatchBatch& p) {
  const Mobility a = mobility(p, p.arm_a, p.inverse_mass_a, p.inverse_inertia_a);
  const Mobility b = mobility(p, p.arm_b, p.inverse_mass_b, p.inverse_inertia_b);
  p.normal_mobility = a.normal + b.normal;
  p.friction_mobility = a.friction + b.friction;
  p.coupling = {a.coupling.x + b.coupling.x, a.coupling.y + b.coupling.y, a.coupling.z + b.coupling.z};
  for (uint32_t i = 0; i < p.count; ++i) {
    PatchBatch::Point& q = p.points[i];
    q.mass *= lane_inverse(point_part(q, p.normal_mobility * point_wrench(q, float_lanes(1))));
  }
}

Symmetric inverse(const Symmetric& m) {
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

void set_mobility(PatchBatch& p) {
  if (is_single(p))
    set_single_mobility(p);
  else
    set_full_mobility(p);
  const Symmetric& K = p.friction_mobility;
  if (is_single(p)) {
    const FloatLanes inverse = lane_inverse(K.xx * K.yy - K.xy * K.xy);
    p.friction_stiffness.xx = inverse * K.yy;
    p.friction_stiffness.xy = -inverse * K.xy;
    p.friction_stiffness.yy = inverse * K.xx;
    p.friction_stiffness.zz = lane_inverse(lane_max(K.xx, K.yy) + lane_abs(K.xy));
  } else {
    p.friction_stiffness = inverse(K);
  }
}

// Filling

/// Clears only the members that are used, because a batch is large.
void clear(PatchBatch& p, const PatchBatch::Index& patches, std::span<const ContactPatch> all, bool alone) {
  static_assert(std::is_trivial_v<PatchBatch>);
  uint32_t count = 0;
  for (uint32_t i : patches)
    if (i != ContactColoring::kNone) count = std::max(count, all[i].count);
  std::memset(&p, 0, offsetof(PatchBatch, points) + count * sizeof(PatchBatch::Point));
  p.count = count;
  p.alone = alone;
  p.tolerance = settled(p);
  p.patch = patches;
}

void set_body(uint32_t index, std::span<const RelaxedBody> bodies, unsigned lane, FloatLanes& inverse_mass,
              Symmetric& inverse_inertia) {
  inverse_mass[lane] = static_cast<float>(bodies[index].inverse_mass);
  if (inverse_mass[lane] > 0) inverse_inertia.set(lane, bodies[index].inverse_inertia);
}

/// Sets the approach at the step's start. These velocities may be large, so they are subtracted in double
/// precision.
void set_approach(PatchBatch& p, unsigned lane, const ContactPatch& c, const RelaxedBody& a,
                  const RelaxedBody& b) {
  const Vec3 linear =
      a.velocity + a.angular_velocity.cross(c.arm_a) - b.velocity - b.angular_velocity.cross(c.arm_b);
  const Vec3 angular = a.angular_velocity - b.angular_velocity;
  const auto& [n, t, k] = c.frame;
  p.approach.normal.set(lane, {n.dot(linear) + c.offset.x(), t.dot(angular), k.dot(angular)});
  p.approach.friction.set(lane, {t.dot(linear) + c.offset.y(), k.dot(linear) + c.offset.z(), n.dot(angular)});
  p.conveyed[lane] = static_cast<float>(c.offset.x());
  if (!c.turns) return;
  if (!std::exchange(p.turns, true)) {
    p.gain = PatchGroups{};
    p.bow = Vector{};
    p.acting = FloatLanes{};
  }
  p.bow.set(lane, c.bow);
  p.acting[lane] = static_cast<float>(c.acting);
  p.gain.normal.set(lane, {c.gain.x(), c.gain_along_k, -c.gain_along_t});
  p.gain.friction.set(lane, {c.gain.y(), c.gain.z(), 0});
}

void set_patch(PatchBatch& p, unsigned lane, const ContactPatch& c, Real substep) {
  const auto narrow = [](Real x) { return static_cast<float>(x); };
  p.n.set(lane, c.frame.n);
  p.t.set(lane, c.frame.t);
  p.k.set(lane, c.frame.k);
  p.arm_a.set(lane, c.arm_a);
  p.arm_b.set(lane, c.arm_b);
  p.friction_t[lane] = narrow(c.friction_t);
  p.friction_k[lane] = narrow(c.friction_k);
  Real arm = 0;
  if (c.rolling > 0 || c.spinning > 0) {
    arm = c.spinning / std::max(std::min(c.friction_t, c.friction_k), kLeastFriction);
    p.resists_turning = true;
    p.rolling[lane] = narrow(c.rolling);
    p.spin_arm[lane] = narrow(arm);
    p.friction_t[lane] = narrow(std::max(c.friction_t, kLeastFriction));
    p.friction_k[lane] = narrow(std::max(c.friction_k, kLeastFriction));
  }
  // A patch of one point has no torque about the normal; sweep_single() does not compute one.
  const bool is_single = c.count == 1;
  p.friction_impulse.set(lane, substep * Vec3(c.force_t, c.force_k, is_single ? 0 : c.torque_n));
  p.friction_mean.set(lane, substep * c.mean_friction);
  for (uint32_t i = 0; i < c.count; ++i) {
    PatchBatch::Point& q = p.points[i];
    q.x[lane] = narrow(c.points[i].t);
    q.y[lane] = narrow(c.points[i].k);
    q.radius[lane] =
        narrow(std::sqrt(c.points[i].t * c.points[i].t + c.points[i].k * c.points[i].k + arm * arm));
    q.mass[lane] = 1;
    q.start[lane] = narrow(c.points[i].separation);
    q.impulse[lane] = narrow(substep * c.points[i].force);
    q.mean[lane] = narrow(substep * c.points[i].mean_force);
  }
  const bool fresh =
      std::none_of(c.points.begin(), c.points.begin() + c.count, [](const auto& q) { return q.force > 0; });
  // There is no initial guess of rolling friction, and the friction depends on it.
  if (fresh || c.rolling > 0) p.tolerance = kSolved;
  p.renewal[lane] = fresh ? 1 : kRenewal;
}

Vector normal_wrench(const PatchBatch& p) {
  Vector f{};
  for (uint32_t i = 0; i < p.count; ++i) {
    const PatchBatch::Point& q = p.points[i];
    f = f + point_wrench(q, q.impulse);
  }
  return f;
}

// Solving

/// Updates the friction impulses and applies the change to the twist `u`. Returns the change.
Vector solve_friction(PatchBatch& p, Groups& u) {
  Vector next = p.friction_impulse - p.friction_stiffness * u.friction;
  const Vector limits = friction_limits(p);
  // Spin does not make a single point slide unless it has spinning friction.
  if (p.resists_turning) next.z = limits.z > FloatLanes{} ? next.z : FloatLanes{};
  const FloatLanes size2 = next.x * next.x + next.y * next.y;
  const auto within = p.friction_t == p.friction_k
                          ? size2 <= limits.x * limits.x
                          : (lane_abs(next.x) <= limits.x) & (lane_abs(next.y) <= limits.y);
  const auto slides = ~(within & (lane_abs(next.z) <= limits.z));
  p.holds = size2 < kHolds * limits.x * limits.y ? float_lanes(1) : FloatLanes{};
  p.pressure = slides ? pressure(p) : FloatLanes{};
  if (_mm256_movemask_ps(FloatLanes(slides)) != 0) {
    const bool isotropic = _mm256_movemask_ps(FloatLanes(p.friction_t == p.friction_k)) == 0xFF;
    const Vector slide = p.resists_turning ? sliding_impulse<false, true>(p, u.friction, limits)
                         : isotropic       ? sliding_impulse<true, false>(p, u.friction, limits)
                                           : sliding_impulse<false, false>(p, u.friction, limits);
    next = {slides ? slide.x : next.x, slides ? slide.y : next.y, slides ? slide.z : next.z};
  }
  const Vector change = next - p.friction_impulse;
  p.friction_impulse = next;
  u.friction = u.friction + p.friction_mobility * change;
  u.normal = u.normal + transposed_product(p.coupling, change);
  return change;
}

/// Updates the rolling friction and applies the change to the twist `u`. Returns the change, in the normal
/// group's terms.
Vector solve_rolling(PatchBatch& p, Groups& u) {
  const Vector change = rolling_impulse(p, u.normal) - p.rolling_impulse;
  p.rolling_impulse = p.rolling_impulse + change;
  u.normal = u.normal + p.normal_mobility * change;
  u.friction = u.friction + p.coupling * change;
  return change;
}

/// For each point, the speed that closes its gap in a sub-step [m/s]; 0 without a gap.
using Gaps = std::array<FloatLanes, 4>;

/// Solves the normal impulses once and applies the change to the twist `u`. Returns the change.
Vector solve_normal(PatchBatch& p, Groups& u, const Gaps& gaps) {
  Vector change{};
  const Symmetric& K = p.normal_mobility;
  for (uint32_t i = 0; i < p.count; ++i) {
    PatchBatch::Point& q = p.points[i];
    const FloatLanes rate = point_part(q, u.normal) + gaps[i];
    const FloatLanes next = lane_max(q.impulse - q.mass * rate, FloatLanes{});
    const FloatLanes d = next - q.impulse;
    q.impulse = next;
    const Vector f = point_wrench(q, d);
    change = change + f;
    u.normal = u.normal + K * f;
  }
  u.friction = u.friction + p.coupling * change;
  return change;
}

/// Moves the impulses by a fixed fraction towards their running means, and updates the means. The change of
/// an impulse is limited to the same fraction of the impulse or, for friction, of Coulomb's limit. Without
/// this limit, the mean impulse of an impact would lift the body that the impact has stopped. The friction of
/// sliding points is set to the limit by the current normal impulses. So the sums over the sub-steps obey
/// Coulomb's law, even if the load shifts between points. Returns the change.
Groups return_to_mean(PatchBatch& p) {
  Groups change{};
  const Vector limits = friction_limits(p);
  for (uint32_t i = 0; i < p.count; ++i) {
    PatchBatch::Point& q = p.points[i];
    const FloatLanes difference = q.mean - q.impulse;
    const FloatLanes d = kReturn * lane_min(difference, q.impulse);
    q.impulse += d;
    q.mean -= p.renewal * difference;
    change.normal = change.normal + point_wrench(q, d);
  }
  // Sliding friction follows from Coulomb's law and has no mean.
  p.friction_mean = p.friction_impulse + p.holds * (p.friction_mean - p.friction_impulse);
  const Vector difference = p.friction_mean - p.friction_impulse;
  const FloatLanes growth = lane_min(pressure(p) * lane_inverse(p.pressure), float_lanes(kMostGrowth));
  const FloatLanes scale = p.pressure > FloatLanes{} ? growth - float_lanes(1) : FloatLanes{};
  change.friction =
      scale * p.friction_impulse + float_lanes(kReturn) * Vector{lane_clamp(difference.x, limits.x),
                                                                 lane_clamp(difference.y, limits.y),
                                                                 lane_clamp(difference.z, limits.z)};
  p.friction_impulse = p.friction_impulse + change.friction;
  p.friction_mean = p.friction_mean - p.renewal * difference;
  return change;
}

bool is_below(FloatLanes x, Real limit) {
  return _mm256_movemask_ps(_mm256_cmp_ps(x, float_lanes(limit), _CMP_GT_OQ)) == 0;
}
FloatLanes greatest(const Vector& v) {
  return lane_max(lane_abs(v.x), lane_max(lane_abs(v.y), lane_abs(v.z)));
}

// The following functions are for patches of one point, as round bodies have. They have no moments.

/// A velocity or impulse at the point, along n, t and k.
using Single = Vector;

Single in_frame(const PatchBatch& p, const Vector& v) {
  return {dot(p.n, v), dot(p.t, v), dot(p.k, v)};
}

/// These two functions replace solve_normal() and solve_friction() for patches of one point, and also return
/// the change.
Single solve_single_normal(PatchBatch& p, Single& u, FloatLanes gap) {
  PatchBatch::Point& q = p.points[0];
  const FloatLanes next = lane_max(q.impulse - q.mass * (u.x + gap), FloatLanes{});
  const FloatLanes d = next - q.impulse;
  q.impulse = next;
  u = u + d * Single{p.normal_mobility.xx, p.coupling.x.x, p.coupling.y.x};
  return {d, FloatLanes{}, FloatLanes{}};
}
Single solve_single_friction(PatchBatch& p, Single& u) {
  const FloatLanes& force = p.points[0].impulse;
  const Vector next = coulomb_impulse(p, {u.y, u.z, FloatLanes{}},
                                      {p.friction_t * force, p.friction_k * force, FloatLanes{}});
  const FloatLanes t = next.x - p.friction_impulse.x, k = next.y - p.friction_impulse.y;
  p.friction_impulse = next;
  const FloatLanes size2 = next.x * next.x + next.y * next.y,
                   limit2 = p.friction_t * p.friction_k * force * force;
  p.holds = size2 < kHolds * limit2 ? float_lanes(1) : FloatLanes{};
  p.pressure = size2 > kSlides * limit2 ? force : FloatLanes{};
  const Symmetric& K = p.friction_mobility;
  u = u + Single{p.coupling.x.x * t + p.coupling.y.x * k, K.xx * t + K.xy * k, K.xy * t + K.yy * k};
  return {FloatLanes{}, t, k};
}

/// Returns the change of the relative twist at the end of a sub-step because arms and frames turn.
/// turning_displacement() returns the displacement that this change has caused before the sub-step.
Groups turning_velocity(const PatchBatch& p, const SubstepTime& time) {
  const FloatLanes now = _mm256_set1_ps(time.s), s = now - p.acting, s2 = now * now - p.acting * p.acting;
  return {s * p.gain.normal + Vector{s2 * p.bow.x, FloatLanes{}, FloatLanes{}},
          s * p.gain.friction + Vector{s2 * p.bow.y, s2 * p.bow.z, FloatLanes{}}};
}
Vector turning_displacement(const PatchBatch& p, const SubstepTime& time) {
  const FloatLanes elapsed = float_lanes(time.elapsed);
  const FloatLanes s = _mm256_set1_ps(time.s_sum) - elapsed * p.acting,
                   s2 = _mm256_set1_ps(time.s2_sum) - elapsed * p.acting * p.acting;
  return s * p.gain.normal + Vector{s2 * p.bow.x, FloatLanes{}, FloatLanes{}};
}

/// Returns the relative twist at the end of a sub-step.
Groups relative_now(const PatchBatch& p, const LaneTwist& a, const LaneTwist& b, const SubstepTime& time) {
  Groups u = relative(p, a, b);
  u.normal = u.normal + p.approach.normal;
  u.friction = u.friction + p.approach.friction;
  if (!p.turns) return u;
  const Groups gain = turning_velocity(p, time);
  return {u.normal + gain.normal, u.friction + gain.friction};
}

/// Whether friction changes the normal velocity noticeably in any lane. Between two balls it does not.
bool is_coupled(const PatchBatch& p) {
  constexpr float kNoticeable = 1e-4F;  // square of the least noticeable change, as a fraction
  const FloatLanes &x = p.coupling.x.x, &y = p.coupling.y.x, &K = p.normal_mobility.xx;
  return _mm256_movemask_ps(FloatLanes(x * x + y * y > kNoticeable * K * K)) != 0;
}

/// Solves the normal impulse and the friction of a point as one system, if the point neither separates nor
/// slides. For rolling bodies they depend on each other so strongly that solving them one after the other
/// converges slowly. Returns the change, and sets `all` if this was possible in all lanes.
Single solve_single_rolling(PatchBatch& p, Single& u, FloatLanes gap, bool& all) {
  const Symmetric& F = p.friction_mobility;
  const Symmetric K{p.normal_mobility.xx, p.coupling.x.x, p.coupling.y.x, F.xx, F.xy, F.yy};
  FloatLanes& force = p.points[0].impulse;
  Vector& friction = p.friction_impulse;
  const Single wanted = inverse(K) * Single{u.x + gap, u.y, u.z};
  const FloatLanes n = force - wanted.x, t = friction.x - wanted.y, k = friction.y - wanted.z;
  const FloatLanes limit_t = p.friction_t * n, limit_k = p.friction_k * n;
  const auto round = p.friction_t == p.friction_k;
  const auto sticks =
      round ? t * t + k * k <= limit_t * limit_t : (lane_abs(t) <= limit_t) & (lane_abs(k) <= limit_k);
  const auto holds = (n >= 0) & sticks;
  all = _mm256_movemask_ps(FloatLanes(holds)) == 0xFF;
  const FloatLanes zero{};
  const Single d{holds ? -wanted.x : zero, holds ? -wanted.y : zero, holds ? -wanted.z : zero};
  force += d.x;
  friction.x += d.y;
  friction.y += d.z;
  p.pressure = zero;
  p.holds = (holds & (t * t + k * k < kHolds * limit_t * limit_k)) ? float_lanes(1) : zero;
  u = u + K * d;
  return d;
}

/// Returns the approach of the points since the start, in the normal group's terms.
Vector moved_normal(const PatchBatch& p, std::span<const BodyMotion> motions, const SubstepTime& time) {
  const LaneTwist a = gather<&BodyMotion::shift>(motions, p.a), b = gather<&BodyMotion::shift>(motions, p.b);
  const Vector& v = p.approach.normal;
  const Vector moved =
      relative(p, a, b).normal + float_lanes(time.elapsed) * Vector{v.x - p.conveyed, v.y, v.z};
  return p.turns ? moved + turning_displacement(p, time) : moved;
}

void sweep_single(PatchBatch& p, std::span<BodyMotion> motions, const SubstepTime& time) {
  const LaneTwist moved_a = gather<&BodyMotion::shift>(motions, p.a),
                  moved_b = gather<&BodyMotion::shift>(motions, p.b);
  FloatLanes separation = p.points[0].start + dot(p.n, relative_velocity(p, moved_a, moved_b)) +
                          float_lanes(time.elapsed) * (p.approach.normal.x - p.conveyed);
  if (p.turns) separation += turning_displacement(p, time).x;
  const FloatLanes gap = float_lanes(1 / time.substep) * lane_max(separation, FloatLanes{});
  LaneTwist a = gather<&BodyMotion::velocity>(motions, p.a), b = gather<&BodyMotion::velocity>(motions, p.b);
  Single u = in_frame(p, relative_velocity(p, a, b)) +
             Single{p.approach.normal.x, p.approach.friction.x, p.approach.friction.y};
  if (p.turns) {
    const Groups gain = turning_velocity(p, time);
    u = u + Single{gain.normal.x, gain.friction.x, gain.friction.y};
  }
  const Single before = u;
  bool all = false;
  Single change{};
  if (p.turns && is_coupled(p)) change = solve_single_rolling(p, u, gap, all);
  const float tolerance = std::exchange(p.tolerance, settled(p));
  if (!all) {
    for (uint32_t i = 0; i < rounds(p); ++i) {
      const Single last = u;
      change = change + solve_single_normal(p, u, gap);
      change = change + solve_single_friction(p, u);
      if (is_below(greatest(u - last), tolerance)) break;
    }
    change = change + solve_single_normal(p, u, gap);
  }
  p.residual = greatest(u - before);
  const Groups back = return_to_mean(p);
  change = change + Single{back.normal.x, back.friction.x, back.friction.y};
  const Vector force = change.x * p.n + change.y * p.t + change.z * p.k;
  a.linear = a.linear + p.inverse_mass_a * force;
  a.angular = a.angular + p.inverse_inertia_a * cross(p.arm_a, force);
  b.linear = b.linear - p.inverse_mass_b * force;
  b.angular = b.angular - p.inverse_inertia_b * cross(p.arm_b, force);
  scatter<&BodyMotion::velocity>(a, motions, p.a, p.moves_a);
  scatter<&BodyMotion::velocity>(b, motions, p.b, p.moves_b);
}

}  // namespace

// Here s = 2 t / h - 1, where t are the ends of the sub-steps and h is the length of the step.
SubstepTime::SubstepTime(Real substep_, uint32_t index, Real duration_)
    : substep(substep_), elapsed(index * substep_), duration(duration_) {
  const Real e = elapsed, first = e * (e + substep) / duration,
             second = 2 * first * (2 * e + substep) / (3 * duration);
  s = static_cast<float>(2 * std::min(e + substep, duration) / duration - 1);
  s_sum = static_cast<float>(first - e);
  s2_sum = static_cast<float>(second - 2 * first + e);
}

void prepare(PatchBatch& p, const PatchBatch::Index& patches, std::span<const ContactPatch> all,
             std::span<const RelaxedBody> bodies, std::span<BodyMotion> motions, Real substep, bool alone) {
  clear(p, patches, all, alone);
  p.a.fill(static_cast<uint32_t>(bodies.size()));
  p.b = p.a;
  for (unsigned lane = 0; lane < kLanes; ++lane) {
    if (patches[lane] == ContactColoring::kNone) continue;
    const ContactPatch& c = all[patches[lane]];
    p.a[lane] = c.a;
    p.b[lane] = c.b;
    set_body(c.a, bodies, lane, p.inverse_mass_a, p.inverse_inertia_a);
    set_body(c.b, bodies, lane, p.inverse_mass_b, p.inverse_inertia_b);
    p.moves_a[lane] = p.inverse_mass_a[lane] > 0;
    p.moves_b[lane] = p.inverse_mass_b[lane] > 0;
    set_patch(p, lane, c, substep);
    if (bodies[c.a].is_link || bodies[c.b].is_link) p.allowed[lane] = kLinkOverlap;
    set_approach(p, lane, c, bodies[c.a], bodies[c.b]);
  }
  set_mobility(p);
  LaneTwist a = gather<&BodyMotion::velocity>(motions, p.a), b = gather<&BodyMotion::velocity>(motions, p.b);
  apply(p, {normal_wrench(p), p.friction_impulse}, a, b);
  scatter<&BodyMotion::velocity>(a, motions, p.a, p.moves_a);
  scatter<&BodyMotion::velocity>(b, motions, p.b, p.moves_b);
}

void begin_substep(PatchBatch& p) {
  for (uint32_t i = 0; i < p.count; ++i) {
    PatchBatch::Point& q = p.points[i];
    q.before += q.impulse;
    q.shift += q.before;
  }
  p.friction_before = p.friction_before + p.friction_impulse;
  p.friction_shift = p.friction_shift + p.friction_before;
  p.rolling_before = p.rolling_before + p.rolling_impulse;
  p.rolling_shift = p.rolling_shift + p.rolling_before;
}

// The friction uses the normal impulses of this sweep. Its effect on the normal velocities is corrected
// afterwards.
void sweep(PatchBatch& p, std::span<BodyMotion> motions, const SubstepTime& time) {
  if (is_single(p)) return sweep_single(p, motions, time);
  const Vector moved = moved_normal(p, motions, time);
  Gaps gaps;
  for (uint32_t i = 0; i < p.count; ++i)
    gaps[i] = float_lanes(1 / time.substep) *
              lane_max(p.points[i].start + point_part(p.points[i], moved), FloatLanes{});
  LaneTwist a = gather<&BodyMotion::velocity>(motions, p.a), b = gather<&BodyMotion::velocity>(motions, p.b);
  Groups u = relative_now(p, a, b, time);
  const Groups before = u;
  Groups change{};
  const float tolerance = std::exchange(p.tolerance, settled(p));
  for (uint32_t i = 0; i < rounds(p); ++i) {
    const Groups last = u;
    change.normal = change.normal + solve_normal(p, u, gaps);
    if (p.resists_turning) change.normal = change.normal + solve_rolling(p, u);
    change.friction = change.friction + solve_friction(p, u);
    FloatLanes change_now = lane_max(greatest(u.normal - last.normal), greatest(u.friction - last.friction));
    if (is_below(change_now, tolerance)) break;
  }
  change.normal = change.normal + solve_normal(p, u, gaps);
  const Vector f = u.friction - before.friction;
  p.residual = lane_max(lane_abs(u.normal.x - before.normal.x), lane_max(lane_abs(f.x), lane_abs(f.y)));
  const Groups back = return_to_mean(p);
  apply(p, {change.normal + back.normal, change.friction + back.friction}, a, b);
  scatter<&BodyMotion::velocity>(a, motions, p.a, p.moves_a);
  scatter<&BodyMotion::velocity>(b, motions, p.b, p.moves_b);
}

void end_substeps(PatchBatch& p, Real substep) {
  const FloatLanes time = float_lanes(substep);
  for (uint32_t i = 0; i < p.count; ++i) {
    PatchBatch::Point& q = p.points[i];
    q.shift = time * (q.shift + q.before + q.impulse);
  }
  p.friction_shift = time * (p.friction_shift + p.friction_before + p.friction_impulse);
  p.rolling_shift = time * (p.rolling_shift + p.rolling_before + p.rolling_impulse);
}

FloatLanes push_out(PatchBatch& p, std::span<BodyMotion> motions, const PushOut& push) {
  LaneTwist a = gather<&BodyMotion::shift>(motions, p.a), b = gather<&BodyMotion::shift>(motions, p.b);
  Vector moved = moved_normal(p, motions, push.time);
  Vector change{};
  FloatLanes farthest{};
  for (uint32_t i = 0; i < p.count; ++i) {
    PatchBatch::Point& q = p.points[i];
    const FloatLanes move = float_lanes(-push.fraction) * (q.start + p.allowed + point_part(q, moved));
    const FloatLanes next =
        lane_min(lane_max(q.push + q.mass * move, FloatLanes{}), q.mass * float_lanes(push.limit));
    const FloatLanes d = next - q.push;
    q.push = next;
    q.shift += d;
    farthest = d != FloatLanes{} ? lane_max(farthest, lane_abs(move)) : farthest;
    const Vector f = point_wrench(q, d);
    change = change + f;
    moved = moved + p.normal_mobility * f;
  }
  apply(p, Groups{change, Vector{}}, a, b);
  scatter<&BodyMotion::shift>(a, motions, p.a, p.moves_a);
  scatter<&BodyMotion::shift>(b, motions, p.b, p.moves_b);
  return farthest;
}

void report(const PatchBatch& p, std::span<ContactPatch> patches, Real substep) {
  const auto lane_of = [](const Vector& v, unsigned lane) { return Vec3(v.x[lane], v.y[lane], v.z[lane]); };
  for (unsigned lane = 0; lane < kLanes; ++lane) {
    if (p.patch[lane] == ContactColoring::kNone) continue;
    ContactPatch& c = patches[p.patch[lane]];
    for (uint32_t i = 0; i < c.count; ++i) {
      const PatchBatch::Point& q = p.points[i];
      c.points[i].force = q.impulse[lane] / substep;
      c.points[i].mean_force = q.mean[lane] / substep;
      c.points[i].impulse = Real{q.before[lane]} + Real{q.impulse[lane]};
      c.points[i].shift = q.shift[lane];
    }
    const Vec3 friction = lane_of(p.friction_impulse, lane);
    c.force_t = friction.x() / substep;
    c.force_k = friction.y() / substep;
    c.torque_n = friction.z() / substep;
    c.mean_friction = lane_of(p.friction_mean, lane) / substep;
    c.friction_impulse = lane_of(p.friction_before, lane) + friction;
    c.friction_shift = lane_of(p.friction_shift, lane);
    c.rolling_impulse = (lane_of(p.rolling_before, lane) + lane_of(p.rolling_impulse, lane)).tail<2>();
    c.rolling_shift = lane_of(p.rolling_shift, lane).tail<2>();
  }
}

}  // namespace offstage::sim
