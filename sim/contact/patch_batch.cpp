#include "sim/contact/patch_batch.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <type_traits>
#include <utility>

#include "sim/contact/contact_coloring.h"
#include "sim/contact/relaxation.h"

namespace offstage::sim {
namespace {

/// A sweep goes over a patch in rounds, until one changes its velocities by less than this [m/s] or there
/// were enough. What holds takes one; a blow takes more, or some of the points would be pressed in. A patch
/// without a guess is at first solved to the end, or it would slip until the sweeps have found one.
constexpr Real kSettled = 0.01, kSolved = 1e-9;
constexpr uint32_t kRounds = 20;

/// Of the difference between an impulse and its mean, the share that a sub-step takes from the impulse, and
/// the share that it adds to the mean. Slow modes lose most if their frequencies are about the latter. A
/// patch without a guess has no past: its means are the impulses.
constexpr Real kReturn = 0.03, kRenewal = 0.01;
/// Friction up to this share of its limit, squared, holds.
constexpr Real kHolds = 0.96;

/// Twists and wrenches of the patches, by group.
struct Groups {
  LaneVector normal;    ///< along n, about t, about k
  LaneVector friction;  ///< along t, along k, about n
};

struct LaneTwist {
  LaneVector linear, angular;
};

template <BodyTwist BodyMotion::*kWhat>
LaneTwist gather(std::span<const BodyMotion> motions, const std::array<uint32_t, 4>& i) {
  const BodyTwist &p = motions[i[0]].*kWhat, &q = motions[i[1]].*kWhat;
  const BodyTwist &r = motions[i[2]].*kWhat, &s = motions[i[3]].*kWhat;
  return {transposed(p.linear, q.linear, r.linear, s.linear),
          transposed(p.angular, q.angular, r.angular, s.angular)};
}

/// Bodies that contacts do not move are left alone: others may be reading them.
template <BodyTwist BodyMotion::*kWhat>
void scatter(const LaneTwist& v, std::span<BodyMotion> motions, const std::array<uint32_t, 4>& i,
             const std::array<bool, 4>& moves) {
  const LaneRows linear = transposed(v.linear), angular = transposed(v.angular);
  BodyTwist ignored;
  const auto place = [&](int lane) -> BodyTwist& {
    return moves[static_cast<unsigned>(lane)] ? motions[i[static_cast<unsigned>(lane)]].*kWhat : ignored;
  };
  place(0) = {linear.a, angular.a};
  place(1) = {linear.b, angular.b};
  place(2) = {linear.c, angular.c};
  place(3) = {linear.d, angular.d};
}

/// At the centre.
LaneVector relative_velocity(const PatchBatch& p, const LaneTwist& a, const LaneTwist& b) {
  return a.linear + cross(a.angular, p.arm_a) - b.linear - cross(b.angular, p.arm_b);
}

Groups relative(const PatchBatch& p, const LaneTwist& a, const LaneTwist& b) {
  const LaneVector linear = relative_velocity(p, a, b);
  const LaneVector angular = a.angular - b.angular;
  return {{dot(p.n, linear), dot(p.t, angular), dot(p.k, angular)},
          {dot(p.t, linear), dot(p.k, linear), dot(p.n, angular)}};
}

/// Of a twist's normal group, what a point has of it along the normal; and the wrench of a normal impulse
/// there.
Lanes point_part(const PatchBatch::Point& q, const LaneVector& normal) {
  return normal.x + q.y * normal.y - q.x * normal.z;
}
LaneVector point_wrench(const PatchBatch::Point& q, Lanes impulse) {
  return {impulse, q.y * impulse, -q.x * impulse};
}

void apply(const PatchBatch& p, const Groups& wrench, LaneTwist& a, LaneTwist& b) {
  const auto &f = wrench.normal, &g = wrench.friction;
  const LaneVector force = f.x * p.n + g.x * p.t + g.y * p.k;
  const LaneVector torque = g.z * p.n + f.y * p.t + f.z * p.k;
  a.linear = a.linear + p.inverse_mass_a * force;
  a.angular = a.angular + p.inverse_inertia_a * (cross(p.arm_a, force) + torque);
  b.linear = b.linear - p.inverse_mass_b * force;
  b.angular = b.angular - p.inverse_inertia_b * (cross(p.arm_b, force) + torque);
}

// What a unit impulse (or angular impulse) along each axis gives to one body, R6's K of patches.

struct Row {
  LaneVector linear, angular;  // the axis in a wrench about the centre of mass
  LaneVector turned;           // inverse inertia times `angular`
};

Lanes mobility(Lanes inverse_mass, const Row& i, const Row& j) {
  return inverse_mass * dot(i.linear, j.linear) + dot(i.angular, j.turned);
}

struct Mobility {
  LaneSymmetric normal, friction;
  LaneMatrix coupling;
};

Mobility mobility(const PatchBatch& p, const LaneVector& arm, Lanes m, const LaneSymmetric& I) {
  const auto force = [&](const LaneVector& axis) {
    const LaneVector moment = cross(arm, axis);
    return Row{axis, moment, I * moment};
  };
  const auto torque = [&](const LaneVector& axis) { return Row{LaneVector{}, axis, I * axis}; };
  const std::array<Row, 3> f = {force(p.n), torque(p.t), torque(p.k)};
  const std::array<Row, 3> g = {force(p.t), force(p.k), torque(p.n)};
  const auto symmetric = [m](const std::array<Row, 3>& r) {
    return LaneSymmetric{mobility(m, r[0], r[0]), mobility(m, r[0], r[1]), mobility(m, r[0], r[2]),
                         mobility(m, r[1], r[1]), mobility(m, r[1], r[2]), mobility(m, r[2], r[2])};
  };
  const auto row = [&](const Row& r) {
    return LaneVector{mobility(m, r, f[0]), mobility(m, r, f[1]), mobility(m, r, f[2])};
  };
  return {symmetric(f), symmetric(g), {row(g[0]), row(g[1]), row(g[2])}};
}

void set_single_mobility(PatchBatch& p) {
  const LaneVector* const axes[] = {&p.n, &p.t, &p.k};
  const auto entry = [&](int i, int j) {
    const LaneVector &x = *axes[i], &y = *axes[j];
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
    q.mass *= lane_inverse(point_part(q, p.normal_mobility * point_wrench(q, lanes(1))));
  }
}

void set_mobility(PatchBatch& p) {
  if (p.count == 1)
    set_single_mobility(p);
  else
    set_full_mobility(p);
  const LaneSymmetric& K = p.friction_mobility;
  p.inverse_determinant = lane_inverse(K.xx * K.yy - K.xy * K.xy);
  p.inverse_bound = lane_inverse(lane_max(K.xx, K.yy) + lane_abs(K.xy));
  p.inverse_spin = lane_inverse(K.zz);
}

// Filling

/// Nothing but what is used: a batch is large.
void clear(PatchBatch& p, std::array<uint32_t, 4> patches, std::span<const ContactPatch> all) {
  static_assert(std::is_trivial_v<PatchBatch>);
  uint32_t count = 0;
  for (uint32_t i : patches)
    if (i != ContactColoring::kNone) count = std::max(count, all[i].count);
  std::memset(&p, 0, offsetof(PatchBatch, points) + count * sizeof(PatchBatch::Point));
  p.count = count;
  p.tolerance = kSettled;
  p.patch = patches;
}

void set_body(uint32_t index, std::span<const RelaxedBody> bodies, int lane, Lanes& inverse_mass,
              LaneSymmetric& inverse_inertia) {
  inverse_mass[lane] = bodies[index].inverse_mass;
  if (inverse_mass[lane] > 0) inverse_inertia.set(lane, bodies[index].inverse_inertia);
}

void set_patch(PatchBatch& p, int lane, const ContactPatch& c, Real substep) {
  p.n.set(lane, c.frame.n);
  p.t.set(lane, c.frame.t);
  p.k.set(lane, c.frame.k);
  p.arm_a.set(lane, c.arm_a);
  p.arm_b.set(lane, c.arm_b);
  p.offset.set(lane, c.offset);
  p.friction_t[lane] = c.friction_t;
  p.friction_k[lane] = c.friction_k;
  p.friction_impulse.set(lane, substep * Vec3(c.force_t, c.force_k, c.torque_n));
  p.friction_mean.set(lane, substep * c.mean_friction);
  for (uint32_t i = 0; i < c.count; ++i) {
    PatchBatch::Point& q = p.points[i];
    q.x[lane] = c.points[i].t;
    q.y[lane] = c.points[i].k;
    q.mass[lane] = 1;
    q.start[lane] = q.separation[lane] = c.points[i].separation;
    q.impulse[lane] = substep * c.points[i].force;
    q.mean[lane] = substep * c.points[i].mean_force;
  }
  const bool fresh =
      std::none_of(c.points.begin(), c.points.end(), [](const auto& q) { return q.force > 0; });
  if (fresh) p.tolerance = kSolved;
  p.renewal[lane] = fresh ? 1 : kRenewal;
}

LaneVector normal_wrench(const PatchBatch& p) {
  LaneVector f{};
  for (uint32_t i = 0; i < p.count; ++i) {
    const PatchBatch::Point& q = p.points[i];
    f = f + point_wrench(q, q.impulse);
  }
  return f;
}

// Solving

/// Coulomb's limits of the impulses along t and k, and of the angular one about n: as if every point's
/// friction were across its arm from the centre.
LaneVector friction_limits(const PatchBatch& p) {
  Lanes force{}, moment{};
  for (uint32_t i = 0; i < p.count; ++i) {
    const PatchBatch::Point& q = p.points[i];
    force += q.impulse;
    moment += q.impulse * lane_sqrt(q.x * q.x + q.y * q.y);
  }
  return {p.friction_t * force, p.friction_k * force, lane_min(p.friction_t, p.friction_k) * moment};
}

/// The impulses along t and k from the velocities u: those that stop the sliding if they are within the
/// limits. Otherwise a step against the velocity, as long as keeps the iteration convergent, and back to the
/// limits; its fixed point opposes the sliding exactly.
LaneVector coulomb_impulse(const PatchBatch& p, const LaneVector& u, const LaneVector& limits) {
  const LaneSymmetric& K = p.friction_mobility;
  const LaneVector& old = p.friction_impulse;
  const Lanes stick_t = old.x - p.inverse_determinant * (K.yy * u.x - K.xy * u.y);
  const Lanes stick_k = old.y - p.inverse_determinant * (K.xx * u.y - K.xy * u.x);
  const Lanes slide_t = old.x - p.inverse_bound * u.x, slide_k = old.y - p.inverse_bound * u.y;
  const Lanes slide = lane_sqrt(slide_t * slide_t + slide_k * slide_k);
  const Lanes scale = slide > limits.x ? limits.x / slide : lanes(1);
  const auto round = p.friction_t == p.friction_k;
  const auto sticks = round ? stick_t * stick_t + stick_k * stick_k <= limits.x * limits.x
                            : (lane_abs(stick_t) <= limits.x) & (lane_abs(stick_k) <= limits.y);
  const Lanes held_t = round ? scale * slide_t : lane_clamp(slide_t, limits.x);
  const Lanes held_k = round ? scale * slide_k : lane_clamp(slide_k, limits.y);
  return {sticks ? stick_t : held_t, sticks ? stick_k : held_k, Lanes{}};
}

/// Changes the friction impulses and the twist `u` by them. Returns the change.
LaneVector solve_friction(PatchBatch& p, Groups& u) {
  const LaneVector limits = friction_limits(p);
  LaneVector next = coulomb_impulse(p, u.friction, limits);
  const LaneSymmetric& K = p.friction_mobility;
  const Lanes spin =
      u.friction.z + K.xz * (next.x - p.friction_impulse.x) + K.yz * (next.y - p.friction_impulse.y);
  next.z = lane_clamp(p.friction_impulse.z - p.inverse_spin * spin, limits.z);
  const LaneVector change = next - p.friction_impulse;
  p.friction_impulse = next;
  u.friction = u.friction + K * change;
  u.normal = u.normal + transposed_product(p.coupling, change);
  return change;
}

/// Likewise one sweep over the normal impulses.
LaneVector solve_normal(PatchBatch& p, Groups& u, Real closing) {
  LaneVector change{};
  const LaneSymmetric& K = p.normal_mobility;
  for (uint32_t i = 0; i < p.count; ++i) {
    PatchBatch::Point& q = p.points[i];
    const Lanes rate = point_part(q, u.normal) + closing * lane_max(q.separation, Lanes{});
    const Lanes next = lane_max(q.impulse - q.mass * rate, Lanes{});
    const Lanes d = next - q.impulse;
    q.impulse = next;
    const LaneVector f = point_wrench(q, d);
    change = change + f;
    u.normal = u.normal + K * f;
  }
  u.friction = u.friction + p.coupling * change;
  return change;
}

/// Takes the impulses a little back towards their means, which follow. No impulse changes by more than that
/// share of itself, or of Coulomb's limit: the mean of a blow must not lift what it has stopped. Returns the
/// change.
Groups return_to_mean(PatchBatch& p) {
  Groups change{};
  const LaneVector limits = friction_limits(p);
  for (uint32_t i = 0; i < p.count; ++i) {
    PatchBatch::Point& q = p.points[i];
    const Lanes difference = q.mean - q.impulse;
    const Lanes d = kReturn * lane_min(difference, q.impulse);
    q.impulse += d;
    q.mean -= p.renewal * difference;
    change.normal = change.normal + point_wrench(q, d);
  }
  // What slides has its friction from the law, which knows no mean.
  const LaneVector& f = p.friction_impulse;
  const Lanes holds = f.x * f.x + f.y * f.y < kHolds * limits.x * limits.y ? lanes(1) : lanes(0);
  p.friction_mean = p.friction_impulse + holds * (p.friction_mean - p.friction_impulse);
  const LaneVector difference = p.friction_mean - p.friction_impulse;
  change.friction =
      lanes(kReturn) * LaneVector{lane_clamp(difference.x, limits.x), lane_clamp(difference.y, limits.y),
                                  lane_clamp(difference.z, limits.z)};
  p.friction_impulse = p.friction_impulse + change.friction;
  p.friction_mean = p.friction_mean - p.renewal * difference;
  return change;
}

bool is_below(Lanes x, Real limit) {
  return _mm256_movemask_pd(_mm256_cmp_pd(x, lanes(limit), _CMP_GT_OQ)) == 0;
}
Lanes greatest(const LaneVector& v) {
  return lane_max(lane_abs(v.x), lane_max(lane_abs(v.y), lane_abs(v.z)));
}

// Patches of one point, as those of round bodies: no moments.

/// A velocity or impulse there, along n, t and k.
using Single = LaneVector;

Single in_frame(const PatchBatch& p, const LaneVector& v) {
  return {dot(p.n, v), dot(p.t, v), dot(p.k, v)};
}

/// What solve_normal() and solve_friction() do. They return the change.
Single solve_single_normal(PatchBatch& p, Single& u, Real closing) {
  PatchBatch::Point& q = p.points[0];
  const Lanes rate = u.x + closing * lane_max(q.separation, Lanes{});
  const Lanes next = lane_max(q.impulse - q.mass * rate, Lanes{});
  const Lanes d = next - q.impulse;
  q.impulse = next;
  u = u + d * Single{p.normal_mobility.xx, p.coupling.x.x, p.coupling.y.x};
  return {d, Lanes{}, Lanes{}};
}
Single solve_single_friction(PatchBatch& p, Single& u) {
  const Lanes& force = p.points[0].impulse;
  const LaneVector next =
      coulomb_impulse(p, {u.y, u.z, Lanes{}}, {p.friction_t * force, p.friction_k * force, Lanes{}});
  const Lanes t = next.x - p.friction_impulse.x, k = next.y - p.friction_impulse.y;
  p.friction_impulse = next;
  const LaneSymmetric& K = p.friction_mobility;
  u = u + Single{p.coupling.x.x * t + p.coupling.y.x * k, K.xx * t + K.xy * k, K.xy * t + K.yy * k};
  return {Lanes{}, t, k};
}

void measure_separations(PatchBatch& p, std::span<const BodyMotion> motions) {
  const LaneTwist a = gather<&BodyMotion::shift>(motions, p.a), b = gather<&BodyMotion::shift>(motions, p.b);
  const LaneVector moved = relative(p, a, b).normal;
  for (uint32_t i = 0; i < p.count; ++i)
    p.points[i].separation = p.points[i].start + point_part(p.points[i], moved);
}

void sweep_single(PatchBatch& p, std::span<BodyMotion> motions, Real closing) {
  const LaneTwist moved_a = gather<&BodyMotion::shift>(motions, p.a),
                  moved_b = gather<&BodyMotion::shift>(motions, p.b);
  p.points[0].separation = p.points[0].start + dot(p.n, relative_velocity(p, moved_a, moved_b));
  LaneTwist a = gather<&BodyMotion::velocity>(motions, p.a), b = gather<&BodyMotion::velocity>(motions, p.b);
  Single u = in_frame(p, relative_velocity(p, a, b)) + p.offset;
  const Single before = u;
  Single change{};
  const Real tolerance = std::exchange(p.tolerance, kSettled);
  for (uint32_t i = 0; i < kRounds; ++i) {
    const Single last = u;
    change = change + solve_single_normal(p, u, closing);
    change = change + solve_single_friction(p, u);
    if (is_below(greatest(u - last), tolerance)) break;
  }
  change = change + solve_single_normal(p, u, closing);
  p.residual = greatest(u - before);
  const Groups back = return_to_mean(p);
  change = change + Single{back.normal.x, back.friction.x, back.friction.y};
  const LaneVector force = change.x * p.n + change.y * p.t + change.z * p.k;
  a.linear = a.linear + p.inverse_mass_a * force;
  a.angular = a.angular + p.inverse_inertia_a * cross(p.arm_a, force);
  b.linear = b.linear - p.inverse_mass_b * force;
  b.angular = b.angular - p.inverse_inertia_b * cross(p.arm_b, force);
  scatter<&BodyMotion::velocity>(a, motions, p.a, p.moves_a);
  scatter<&BodyMotion::velocity>(b, motions, p.b, p.moves_b);
}

}  // namespace

void prepare(PatchBatch& p, std::array<uint32_t, 4> patches, std::span<const ContactPatch> all,
             std::span<const RelaxedBody> bodies, std::span<BodyMotion> motions, Real substep) {
  clear(p, patches, all);
  p.a.fill(static_cast<uint32_t>(bodies.size()));
  p.b = p.a;
  for (int lane = 0; lane < 4; ++lane) {
    const auto l = static_cast<unsigned>(lane);
    if (patches[l] == ContactColoring::kNone) continue;
    const ContactPatch& c = all[patches[l]];
    p.a[l] = c.a;
    p.b[l] = c.b;
    set_body(c.a, bodies, lane, p.inverse_mass_a, p.inverse_inertia_a);
    set_body(c.b, bodies, lane, p.inverse_mass_b, p.inverse_inertia_b);
    p.moves_a[l] = p.inverse_mass_a[lane] > 0;
    p.moves_b[l] = p.inverse_mass_b[lane] > 0;
    set_patch(p, lane, c, substep);
  }
  set_mobility(p);
  LaneTwist a = gather<&BodyMotion::velocity>(motions, p.a), b = gather<&BodyMotion::velocity>(motions, p.b);
  apply(p, {normal_wrench(p), p.friction_impulse}, a, b);
  scatter<&BodyMotion::velocity>(a, motions, p.a, p.moves_a);
  scatter<&BodyMotion::velocity>(b, motions, p.b, p.moves_b);
}

void begin_substep(PatchBatch& p) {
  for (uint32_t i = 0; i < p.count; ++i) p.points[i].before += p.points[i].impulse;
  p.friction_before = p.friction_before + p.friction_impulse;
}

// The friction sees the normal impulses of this sweep, and what it does to the normal velocities is made
// good.
void sweep(PatchBatch& p, std::span<BodyMotion> motions, Real closing) {
  if (p.count == 1) return sweep_single(p, motions, closing);
  measure_separations(p, motions);
  LaneTwist a = gather<&BodyMotion::velocity>(motions, p.a), b = gather<&BodyMotion::velocity>(motions, p.b);
  Groups u = relative(p, a, b);
  u.normal.x += p.offset.x;
  u.friction.x += p.offset.y;
  u.friction.y += p.offset.z;
  const Groups before = u;
  Groups change{};
  const Real tolerance = std::exchange(p.tolerance, kSettled);
  for (uint32_t i = 0; i < kRounds; ++i) {
    const Groups last = u;
    change.normal = change.normal + solve_normal(p, u, closing);
    change.friction = change.friction + solve_friction(p, u);
    const Lanes moved = lane_max(greatest(u.normal - last.normal), greatest(u.friction - last.friction));
    if (is_below(moved, tolerance)) break;
  }
  change.normal = change.normal + solve_normal(p, u, closing);
  const LaneVector f = u.friction - before.friction;
  p.residual = lane_max(lane_abs(u.normal.x - before.normal.x), lane_max(lane_abs(f.x), lane_abs(f.y)));
  const Groups back = return_to_mean(p);
  apply(p, {change.normal + back.normal, change.friction + back.friction}, a, b);
  scatter<&BodyMotion::velocity>(a, motions, p.a, p.moves_a);
  scatter<&BodyMotion::velocity>(b, motions, p.b, p.moves_b);
}

void push_out(PatchBatch& p, std::span<BodyMotion> motions, Real share, Real limit) {
  LaneTwist a = gather<&BodyMotion::shift>(motions, p.a), b = gather<&BodyMotion::shift>(motions, p.b);
  Groups moved = relative(p, a, b);
  LaneVector change{};
  for (uint32_t i = 0; i < p.count; ++i) {
    const PatchBatch::Point& q = p.points[i];
    const Lanes s = q.start + point_part(q, moved.normal);
    const Lanes d = q.mass * lane_min(lane_max(-share * s, Lanes{}), lanes(limit));
    const LaneVector f = point_wrench(q, d);
    change = change + f;
    moved.normal = moved.normal + p.normal_mobility * f;
  }
  apply(p, Groups{change, LaneVector{}}, a, b);
  scatter<&BodyMotion::shift>(a, motions, p.a, p.moves_a);
  scatter<&BodyMotion::shift>(b, motions, p.b, p.moves_b);
}

void report(const PatchBatch& p, std::span<ContactPatch> patches, Real substep) {
  for (int lane = 0; lane < 4; ++lane) {
    const uint32_t index = p.patch[static_cast<unsigned>(lane)];
    if (index == ContactColoring::kNone) continue;
    ContactPatch& c = patches[index];
    for (uint32_t i = 0; i < c.count; ++i) {
      c.points[i].force = p.points[i].impulse[lane] / substep;
      c.points[i].mean_force = p.points[i].mean[lane] / substep;
      c.points[i].impulse = p.points[i].before[lane] + p.points[i].impulse[lane];
    }
    c.force_t = p.friction_impulse.x[lane] / substep;
    c.force_k = p.friction_impulse.y[lane] / substep;
    c.torque_n = p.friction_impulse.z[lane] / substep;
    const LaneVector& mean = p.friction_mean;
    c.mean_friction = Vec3(mean.x[lane], mean.y[lane], mean.z[lane]) / substep;
    const LaneVector sum = p.friction_before + p.friction_impulse;
    c.friction_impulse = Vec3(sum.x[lane], sum.y[lane], sum.z[lane]);
  }
}

}  // namespace offstage::sim
