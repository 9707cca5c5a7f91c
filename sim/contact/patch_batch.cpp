#include "sim/contact/patch_batch.h"

#include <algorithm>
#include <utility>

#include "sim/contact/patch_motion.h"

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
float next_tolerance(PatchBatch& p) {
  return std::exchange(p.is_fresh, false) ? kSolved : p.alone ? kAlone : kSettled;
}

/// Fraction of the difference between an impulse and its running mean by which a sub-step moves the impulse.
/// Slow modes whose frequency is near PatchBatch::renewal are damped most.
constexpr float kReturn = 0.03F;
/// Friction sticks below the fraction kHolds of its limit, and slides above the fraction kSlides. Both are
/// fractions of squared values.
constexpr float kHolds = 0.96F, kSlides = 0.999F;
/// Greatest factor by which sliding friction follows a later increase of the normal impulses. A larger one
/// could reverse the sliding.
constexpr float kMostGrowth = 1.1F;

using Vector = PatchBatch::Vector;
using Symmetric = PatchBatch::Symmetric;
using Groups = PatchGroups;

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
  const float tolerance = next_tolerance(p);
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
  const float tolerance = next_tolerance(p);
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

}  // namespace offstage::sim
