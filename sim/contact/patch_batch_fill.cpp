/// Fills batches from contact patches, and writes their results back.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <type_traits>
#include <utility>

#include "sim/contact/patch_motion.h"
#include "sim/contact/relaxation.h"

namespace offstage::sim {
namespace {

/// Fraction by which a sub-step renews the running mean of an impulse. The mean of a patch without an initial
/// guess is its impulse.
constexpr float kRenewal = 0.01F;
/// Overlap of a link that push-out leaves [m]. Push-out lifts bodies without work. Where it removed the
/// overlaps of micrometres that the error of the sweeps causes, it replaced the energy that a car on soft
/// springs lost as it rocked on the edges of its wheels, and the car trembled at 2 mm/s for ever.
constexpr float kLinkOverlap = 1e-5F;
/// Lower bound of the coefficient of friction of contacts with spinning friction, which is relative to it.
constexpr Real kLeastFriction = 1e-4;

using Vector = PatchBatch::Vector;
using Symmetric = PatchBatch::Symmetric;
using Groups = PatchGroups;

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

/// Clears only the members that are used, because a batch is large.
void clear(PatchBatch& p, const PatchBatch::Index& patches, std::span<const ContactPatch> all, bool alone) {
  static_assert(std::is_trivial_v<PatchBatch>);
  uint32_t count = 0;
  for (uint32_t i : patches)
    if (i != ContactColoring::kNone) count = std::max(count, all[i].count);
  std::memset(&p, 0, offsetof(PatchBatch, points) + count * sizeof(PatchBatch::Point));
  p.count = count;
  p.alone = alone;
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
  p.is_fresh |= fresh || c.rolling > 0;
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

}  // namespace

void prepare(PatchBatch& p, const PatchBatch::Index& patches, std::span<const ContactPatch> all,
             std::span<const RelaxedBody> bodies, std::span<BodyMotion> motions, Real substep, bool alone) {
  clear(p, patches, all, alone);
  p.a.fill(static_cast<uint32_t>(bodies.size()));
  p.b = p.a;
  for (unsigned lane = 0; lane < ContactColoring::kLanes; ++lane) {
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

void report(const PatchBatch& p, std::span<ContactPatch> patches, Real substep) {
  const auto lane_of = [](const Vector& v, unsigned lane) { return Vec3(v.x[lane], v.y[lane], v.z[lane]); };
  for (unsigned lane = 0; lane < ContactColoring::kLanes; ++lane) {
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
