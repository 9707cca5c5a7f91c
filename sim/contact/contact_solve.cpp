#include "sim/contact/contact_solve.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "sim/contact/contact_motion.h"
#include "sim/contact/energy_guard.h"
#include "sim/contact/rough_collision.h"
#include "sim/parallel_loop.h"

namespace offstage::sim {
namespace {

/// Of a penetration, the share that a step takes back, and the fastest that it does so [m/s].
constexpr Real kPushOut = 0.2, kFastestPush = 0.5;
/// Points that meet faster than this have come together in the interval, not before [m/s].
constexpr Real kClosing = 1e-3;
/// Of the normal velocity that turning makes in half an interval, what a contact that holds may be off by.
constexpr Real kTurningShare = 0.5;
/// A blocked body blocks its neighbours, and these theirs, so many times, where they would overlap by more
/// [m].
constexpr int kBlockPasses = 20;
constexpr Real kOverlap = 1e-6;
/// What slides slower than this is at rest, to static friction [m/s].
constexpr Real kSlip = 1e-3;
/// A fall-back with more than this left over [m/s], or with more energy than before but for rounding, is
/// none.
constexpr Real kRough = 1e-2, kEnergyRounding = 1e-9;
/// Of the kinetic energy, what the velocity terms of a solution may add in a step.
constexpr Real kTermsShare = 0.02;

/// The material point of a round body that stands for a point of its surface: on the axis, or at the centre.
/// The surface turns through the contact, these do not.
Vec3 core_point(const Body& body, const Vec3& place) {
  const Shape& shape = body.def.shape;
  if (std::holds_alternative<Sphere>(shape)) return body.start_pose.position;
  if (!std::holds_alternative<Capsule>(shape) && !std::holds_alternative<Cylinder>(shape) &&
      !std::holds_alternative<Cone>(shape))
    return place;
  const Vec3 local = body.start_pose.point_to_body(place);
  return body.start_pose.point_to_world(Vec3(0, local.y(), 0));
}

struct PointRates {
  Vec3 velocity, acceleration;  ///< of a material point at the start; the latter without forces: w x (w x r)
};

PointRates rates(const Body& body, const Vec3& place) {
  if (body.is_awake()) {
    const Vec3 &w = body.start_twist.angular_velocity, wr = w.cross(place - body.start.position);
    return {body.start_twist.velocity + wr, w.cross(wr)};
  }
  // The velocities of kinematic bodies are those of the interval's end, so nothing is missing from them.
  return {body.start_velocity(place), Vec3::Zero()};
}

Twist twist(const Body& body) {
  // At the origin of the world's axes.
  if (body.is_awake()) {
    const Vec3& w = body.start_twist.angular_velocity;
    return {body.start_twist.velocity - w.cross(body.start.position), w};
  }
  if (!body.is_kinematic()) return {};
  const Vec3& w = body.drive.angular_velocity;
  return {body.drive.velocity - w.cross(body.pose.position), w};
}

bool is_face(NormalSource s) {
  return s == NormalSource::face_of_a || s == NormalSource::face_of_b;
}

/// Square of the angular velocity [1/s^2]. Below this, faces do not turn in a step.
constexpr Real kNoSpin = 1e-14;
Real spin(const Body& body) {
  if (body.is_awake()) return body.start_twist.angular_velocity.squaredNorm();
  return body.is_kinematic() ? body.drive.angular_velocity.squaredNorm() : 0;
}

/// What the relative acceleration of R9 has besides the part that is linear in the accelerations of the
/// bodies:
///   n . (c_a'' - c_b'') + 2 n' . (c_a' - c_b') - |n'|^2 D
/// with material points c on both bodies at a distance D along n. (Of two centres of spheres, this is
/// n.c'' + n'.c', not twice the latter.) Tangentially, what turns with the bodies. Returned is what this
/// makes of the relative velocity in an interval of length h, in the contact's frame.
///
/// The terms with n' hold while n turns little. Of sharp corners that slide past each other, and of edges
/// that are almost parallel, it turns by any angle in no time; then as much of the sliding as there is has
/// become parting, and no more. Of two points that pass each other with the velocity s, T = s^2 / D makes
///   d/dt |(D, s t)| at h = T h / sqrt(1 + (T h / s)^2),
/// which is used for all.
Vec3 velocity_bias(const ContactPair& pair, const PlacedManifold& placed, const ContactPoint& point, Real h) {
  const Manifold& m = placed.manifold;
  if (is_face(m.source) && spin(pair.a()) < kNoSpin && spin(pair.b()) < kNoSpin) return Vec3::Zero();
  const Vec3 place_a = m.source == NormalSource::face_of_a ? point.on_a : core_point(pair.a(), point.on_a);
  const Vec3 place_b = m.source == NormalSource::face_of_b ? point.on_b : core_point(pair.b(), point.on_b);
  const PointRates a = rates(pair.a(), place_a), b = rates(pair.b(), place_b);
  const Vec3 n_rate =
      is_face(m.source)
          ? twist(m.source == NormalSource::face_of_a ? pair.a() : pair.b()).angular_velocity.cross(m.normal)
          : normal_rate(m, point, twist(pair.a()), twist(pair.b()));
  const Vec3 velocity = a.velocity - b.velocity, acceleration = a.acceleration - b.acceleration;
  const Real distance = m.normal.dot(place_a - place_b);
  const Real turned = h * (2 * n_rate.dot(velocity) - n_rate.squaredNorm() * distance);
  const Real sliding2 = (velocity - m.normal.dot(velocity) * m.normal).squaredNorm();
  const Real parting = turned == 0 ? 0 : turned * std::sqrt(sliding2 / (sliding2 + turned * turned));
  return {h * m.normal.dot(acceleration) + parting, h * placed.frame.t.dot(acceleration),
          h * placed.frame.k.dot(acceleration)};
}

/// Velocity that conveyor-like surfaces add.
Vec3 surface_velocity(const ContactPair& pair) {
  if (!pair.surface().conveys) return Vec3::Zero();
  return pair.a().start_pose.vector_to_world(pair.a().def.surface_velocity) -
         pair.b().start_pose.vector_to_world(pair.b().def.surface_velocity);
}

Vec3 in_frame(const ContactFrame& f, const Vec3& v) {
  return {f.n.dot(v), f.t.dot(v), f.k.dot(v)};
}

/// Along and across the grain; static if nothing slides yet.
std::pair<Real, Real> friction(const PairSurface& surface, const Vec3& u) {
  const bool slips = u.y() * u.y() + u.z() * u.z() > kSlip * kSlip;
  const Real mu = slips ? surface.friction : surface.static_friction;
  return {mu, mu * surface.cross};
}

/// Where a body's velocities are given: of kinematic ones at the interval's end, for which they hold.
Vec3 origin(const Body& body) {
  return body.is_awake() ? body.start.position : body.pose.position;
}

/// The world's inverse inertia at an orientation.
Mat3 inverse_inertia(const RigidBody& body, const Quat& orientation) {
  const Mat3 R = orientation.toRotationMatrix();
  return R * body.inverse_inertia * R.transpose();
}

/// The rotation by a vector of angle times axis: exact enough by series for what contacts turn in a step, and
/// without trigonometry, whose last bits differ between libraries.
Quat rotation(const Vec3& v) {
  const Real s = v.squaredNorm() / 4;
  const Real sine = 1 - s / 6 * (1 - s / 20 * (1 - s / 42)), cosine = 1 - s / 2 * (1 - s / 12 * (1 - s / 30));
  return Quat(cosine, sine * v.x() / 2, sine * v.y() / 2, sine * v.z() / 2);
}

/// The inverse, as exact: of the turn from one orientation to another.
Vec3 rotation_vector(const Quat& from, const Quat& to) {
  const Quat turn = to * from.conjugate();
  const Vec3 sine = turn.w() < 0 ? Vec3(-turn.vec()) : Vec3(turn.vec());
  const Real s = sine.squaredNorm();
  return 2 * (1 + s / 6 * (1 + 9 * s / 20 * (1 + 25 * s / 42))) * sine;
}

void displace(Body& body, const Vec3& shift, const Vec3& turn) {
  RigidBody& r = body.rigid;
  r.position += shift;
  if (turn != Vec3::Zero()) r.orientation = (rotation(turn) * r.orientation).normalized();
  body.pose = r.pose();
}

}  // namespace

// Joints

bool has_forces(const Island& island) {
  return !island.pairs.empty() || std::any_of(island.articulations.begin(), island.articulations.end(),
                                              [](const Articulation* a) { return a->has_bounded_rows(); });
}

void IslandJoints::collect_constraints(const Island& island, Real time, bool at_start) {
  const auto row = [](const Articulation& a, uint32_t link) {
    return link == JointSystem::kDriven ? kUnmoved : a.bodies()[link]->row;
  };
  for (Articulation* a : island.articulations) {
    a->place(time, at_start);
    articulations_.push_back(a);
    const JointSystem& system = a->system();
    for (std::size_t j = 0; j < system.joints().size(); ++j)
      constraints_.push_back(
          {row(*a, system.joints()[j].a), row(*a, system.joints()[j].b), &system.rows()[j]});
  }
}

void IslandJoints::collect(std::span<const Island* const> islands, const ContactInterval& interval) {
  articulations_.clear();
  constraints_.clear();
  bounded_.clear();
  origins_.clear();
  bounded_ends_.clear();
  impulses_.clear();
  for (const Island* island : islands) {
    const std::size_t first = articulations_.size();
    collect_constraints(*island, interval.end, false);
    for (std::size_t i = first; i < articulations_.size(); ++i) {
      collect_bounded_rows(*articulations_[i], interval.duration, interval.end, bounded_, origins_);
      bounded_ends_.push_back(static_cast<uint32_t>(bounded_.size()));
      for (const Joint* joint : articulations_[i]->joints())
        impulses_.push_back(interval.duration * joint->reaction);
    }
  }
}

void IslandJoints::collect_for_collision(const Island& island, Real time) {
  articulations_.clear();
  constraints_.clear();
  bounded_.clear();
  origins_.clear();
  collect_constraints(island, time, true);
  for (const Articulation* a : articulations_) collect_stops(*a, time, bounded_, origins_);
  impulses_.assign(constraints_.size(), Vec6::Zero());
}

/// What a row with bounds does to its joint.
Wrench IslandJoints::wrench(std::size_t i, Real impulse) const {
  const Vec6 on_a = impulse * bounded_[i].on_a;
  return {on_a.head<3>(), on_a.tail<3>() - origins_[i].arm.cross(on_a.head<3>())};
}

void IslandJoints::tell_blows() {
  for (std::size_t i = 0; i < bounded_.size(); ++i) origins_[i].joint->blow += wrench(i, bounded_[i].impulse);
  std::size_t first = 0;
  for (Articulation* a : articulations_) {
    a->add_blows(std::span(impulses_).subspan(first, a->joints().size()));
    first += a->joints().size();
  }
}

void IslandJoints::tell(Real duration) {
  for (std::size_t i = 0; i < bounded_.size(); ++i) {
    const Real effort = bounded_[i].impulse / duration;
    origins_[i].joint->efforts[origins_[i].slot] = effort;
    origins_[i].joint->load += wrench(i, effort);
  }
  std::size_t first = 0;
  for (Articulation* a : articulations_) {
    const std::span of_articulation = std::span(impulses_).subspan(first, a->joints().size());
    a->add_loads(of_articulation, duration);
    for (std::size_t j = 0; j < of_articulation.size(); ++j)
      a->joints()[j]->reaction = of_articulation[j] / duration;
    first += of_articulation.size();
  }
}

// Exact

ExactContacts::Outcome ExactContacts::solve(const Island& island, const ContactInterval& interval,
                                            Real budget) {
  bodies_.clear();
  contacts_.clear();
  pairs_.clear();
  forces_.clear();
  approach_.clear();
  for (Body* body : island.bodies) {
    body->row = static_cast<uint32_t>(bodies_.size());
    add_body(*body);
  }
  for (ContactPair* pair : island.pairs) add_points(*pair, interval);
  const Island* const one[] = {&island};
  joints_.collect(one, interval);
  if (contacts_.empty() && joints_.bounded().empty()) return {.is_applied = true, .work = {}};

  free_ = bodies_;
  const std::optional<ContactWork> work = newton_.solve(bodies_, contacts_, joints_.problem(), budget);
  if (!work) return {};
  Outcome outcome{.is_applied = is_safe(*work), .work = *work};
  if (!outcome.is_applied) outcome.work.fallbacks = 1;
  if (outcome.work.fallbacks > 0)
    if (const auto worst = worst_contact(bodies_, contacts_)) outcome.rough = pairs_[*worst];
  if (!outcome.is_applied) return outcome;
  joints_.tell(interval.duration);
  for (std::size_t i = 0; i < contacts_.size(); ++i)
    forces_[i]->now = contacts_[i].impulse / interval.duration;
  if (interval.is_whole)
    for (PointForce* force : forces_) force->last = force->now;
  move_bodies(island, interval.duration);
  return outcome;
}

/// Contacts that push out of overlaps from two sides have no solution; then impulses without bounds cancel
/// but for what throws bodies away. And the velocity terms of R9 are wrong where a thin body turns far in a
/// step. Surfaces that drive, motors and friction in joints may do work; all else may only take energy, but
/// for the speed at which overlaps are pushed out, and a small share for those terms.
bool ExactContacts::is_safe(const ContactWork& work) const {
  if (work.fallbacks > 0 && work.residual > kRough) return false;
  Real energy = added_energy(free_, bodies_, contacts_);
  const auto power = [](const BoundedRow& r, std::span<const ContactBody> bodies) {
    Real u = r.offset;
    for (const auto& [body, on] : {std::pair(r.a, &r.on_a), std::pair(r.b, &r.on_b)})
      if (body != kUnmoved)
        u += on->head<3>().dot(bodies[body].velocity) + on->tail<3>().dot(bodies[body].angular_velocity);
    return r.impulse * u;
  };
  for (const BoundedRow& r : joints_.bounded())
    if (!std::isfinite(r.lower) || !std::isfinite(r.upper))
      energy += (power(r, free_) + power(r, bodies_)) / 2;
  if (energy <= 0) return true;

  Real push = 0, kinetic = 0, mass = 0;
  for (const Contact& c : contacts_)
    if (c.impulse.x() > 0) push = std::max(push, c.target);
  for (const ContactBody& body : free_) {
    if (!body.is_moved()) continue;
    mass += 1 / body.inverse_mass;
    kinetic += body.velocity.squaredNorm() / body.inverse_mass / 2 +
               body.angular_velocity.dot(body.inverse_inertia.inverse() * body.angular_velocity) / 2;
  }
  if (work.fallbacks > 0) return energy <= kEnergyRounding * kinetic;
  return energy <= kTermsShare * kinetic + mass * push * push / 2;
}

uint32_t ExactContacts::add_body(Body& body) {
  ContactBody b;
  if (body.is_awake()) {
    b.inverse_mass = 1 / body.rigid.mass;
    b.inverse_inertia = inverse_inertia(body.rigid, body.rigid.orientation);
    b.velocity = body.rigid.velocity();
    b.angular_velocity = body.rigid.angular_velocity();
  } else if (body.is_kinematic()) {
    b.velocity = body.drive.velocity;
    b.angular_velocity = body.drive.angular_velocity;
  }
  bodies_.push_back(b);
  return static_cast<uint32_t>(bodies_.size() - 1);
}

void ExactContacts::add_points(ContactPair& pair, const ContactInterval& interval) {
  const Real h = interval.duration;
  const uint32_t a = pair.a().is_awake() ? pair.a().row : add_body(pair.a());
  const uint32_t b = pair.b().is_awake() ? pair.b().row : add_body(pair.b());
  const Vec3 surface = surface_velocity(pair);
  for (PlacedManifold& m : pair.manifolds())
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const ContactPoint& point = m.manifold.points[k];
      const bool touches = point.separation <= kTouching;
      if (pair.by_event && !touches) continue;
      const Vec3 place = (point.on_a + point.on_b) / 2;
      const Vec3 u = in_frame(m.frame, pair.relative_velocity(place) + surface);
      const ContactMotion motion =
          contact_motion(pair.a(), pair.b(), m.manifold, m.frame, place, h, interval.substep);
      Contact c{.a = a, .b = b, .frame = motion.frame};
      c.arm_a = motion.middle.arm_a;
      c.arm_b = motion.middle.arm_b;
      c.offset = in_frame(c.frame, surface);
      if (touches) c.bias = motion.turns ? Vec3(motion.gain + motion.bow) : velocity_bias(pair, m, point, h);
      c.offset += c.bias;
      // In a moment that an impact has left of a sub-step, it would be pushed out as fast as the moment is
      // short.
      c.target = touches ? std::min(-kPushOut * point.separation / interval.substep, kFastestPush)
                         : -point.separation / h;
      std::tie(c.friction_t, c.friction_k) = friction(pair.surface(), u);
      c.impulse = h * m.forces[k].last;
      c.is_guessed = m.forces[k].known;
      contacts_.push_back(c);
      pairs_.push_back(&pair);
      forces_.push_back(&m.forces[k]);
      // What turns meets by a little more or less than the prediction of how it turns has it.
      approach_.push_back(std::max(0.0, std::abs(u.x()) - kTurningShare * std::abs(motion.gain.x())));
    }
}

/// Forces that act throughout the interval move bodies by half of what they change the velocity times the
/// time. A body of which a contact closed in the interval, or parted and came back, is blocked from some time
/// in it on: it gets as far as its new velocity brings it, which is what the contact's target speaks of.
void ExactContacts::move_bodies(const Island& island, Real duration) {
  closing_.assign(bodies_.size(), 0);
  for (std::size_t i = 0; i < contacts_.size(); ++i)
    if (approach_[i] > kClosing && contacts_[i].impulse.x() > 0)
      closing_[contacts_[i].a] = closing_[contacts_[i].b] = 1;
  close_stops();
  close_neighbors(island, duration);
  for (std::size_t i = 0; i < island.bodies.size(); ++i) {
    Body& body = *island.bodies[i];
    Vec3 dv = bodies_[i].velocity - free_[i].velocity,
         dw = bodies_[i].angular_velocity - free_[i].angular_velocity;
    body.rigid.momentum += body.rigid.mass * dv;
    body.rigid.angular_momentum += body.rigid.spin_momentum(body.rigid.orientation, dw);
    if (closing_[i]) {
      dv += bodies_[i].velocity - body.start_twist.velocity;
      dw += bodies_[i].angular_velocity - body.start_twist.angular_velocity;
    }
    displace(body, duration / 2 * dv, duration / 2 * dw);
  }
}

/// A blocked body gets less far than one that moves on, whose new velocity is the same: by half of what
/// forces change that in the interval. Where this would be an overlap the other one is blocked as well.
void ExactContacts::close_neighbors(const Island& island, Real duration) {
  const auto way = [&](uint32_t i, const Vec3& arm) {
    const Vec3 end = bodies_[i].velocity_at(arm);
    if (i >= island.bodies.size() || closing_[i]) return Vec3(duration * end);
    return Vec3(duration / 2 * (end + island.bodies[i]->start_twist.at(arm)));
  };
  bool changed = true;
  for (int pass = 0; changed && pass < kBlockPasses; ++pass) {
    changed = false;
    for (const Contact& c : contacts_) {
      if (closing_[c.a] == closing_[c.b]) continue;
      const Real separation = std::max(0.0, -c.target * duration);
      if (separation + c.frame.n.dot(way(c.a, c.arm_a) - way(c.b, c.arm_b)) > -kOverlap) continue;
      closing_[c.a] = closing_[c.b] = 1;
      changed = true;
    }
  }
}

/// Joints that got to where they stop block their bodies likewise.
void ExactContacts::close_stops() {
  for (std::size_t i = 0; i < joints_.bounded().size(); ++i) {
    const BoundedRow& row = joints_.bounded()[i];
    if (!joints_.origins()[i].is_stop || row.impulse == 0) continue;
    for (uint32_t body : {row.a, row.b})
      if (body != kUnmoved) closing_[body] = 1;
  }
}

// Fast

namespace {

RelaxedBody relaxed(const Body& body, const ContactInterval& interval) {
  RelaxedBody b;
  const Real duration = interval.duration;
  if (body.is_awake()) {
    b.inverse_mass = 1 / body.rigid.mass;
    // At the end, so that velocities and momenta agree there.
    b.inverse_inertia = inverse_inertia(body.rigid, body.rigid.orientation);
    b.velocity = body.start_twist.velocity;
    b.angular_velocity = body.start_twist.angular_velocity;
    b.free_acceleration = (body.rigid.velocity() - b.velocity) / duration;
    b.free_angular_acceleration = (body.rigid.angular_velocity() - b.angular_velocity) / duration;
  } else if (body.is_kinematic()) {
    b.velocity = body.drive.velocity;
    b.angular_velocity = body.drive.angular_velocity;
    if (!interval.is_whole) return b;
    // Evenly accelerated, so that it gets to where it gets with the velocity that it has there.
    const Vec3 mean = (body.pose.position - body.start_pose.position) / duration;
    const Vec3 mean_spin = rotation_vector(body.start_pose.orientation, body.pose.orientation) / duration;
    b.free_acceleration = 2 / duration * (b.velocity - mean);
    b.free_angular_acceleration = 2 / duration * (b.angular_velocity - mean_spin);
    b.velocity = 2 * mean - b.velocity;
    b.angular_velocity = 2 * mean_spin - b.angular_velocity;
  }
  return b;
}

/// How the contact at its centre moves. The points go with the body that carries it.
void set_motion(ContactPatch& patch, const ContactMotion& motion) {
  patch.arm_a = motion.middle.arm_a;
  patch.arm_b = motion.middle.arm_b;
  patch.turns = motion.turns;
  if (!motion.turns) return;
  for (uint32_t i = 0; i < patch.count; ++i) {
    ContactPatch::Point& p = patch.points[i];
    const Vec3 arm = motion.middle.turn * (p.t * patch.frame.t + p.k * patch.frame.k);
    p.t = motion.frame.t.dot(arm);
    p.k = motion.frame.k.dot(arm);
  }
  patch.frame = motion.frame;
  patch.gain = motion.gain;
  patch.bow = motion.bow;
  patch.gain_along_t = motion.gain_along_t;
  patch.gain_along_k = motion.gain_along_k;
}

/// Of a manifold, with the forces that it begins with. What the patch was in another step does not matter.
void set_patch(ContactPatch& patch, const ContactPair& pair, const PlacedManifold& m,
               const ContactInterval& interval) {
  const Real duration = interval.duration;
  const Vec3 centre_a = start_centre(pair.a()), surface = surface_velocity(pair);
  // What else of a rim is near does not say where on it the contact is.
  const bool runs = runs_along(pair.a(), duration) || runs_along(pair.b(), duration);
  set_points(patch, m.manifold, m.frame, centre_a, start_centre(pair.b()), runs);
  const Vec3 place = centre_a + patch.arm_a;
  const Vec3 u = in_frame(m.frame, pair.relative_velocity(place) + surface);
  set_motion(patch,
             contact_motion(pair.a(), pair.b(), m.manifold, m.frame, place, duration, interval.substep));
  patch.offset = in_frame(patch.frame, surface);
  std::tie(patch.friction_t, patch.friction_k) = friction(pair.surface(), u);
  Vec3 last(0, 0, m.torque), mean(0, 0, m.mean_torque);
  for (uint32_t k = 0; k < patch.count; ++k) {
    const PointForce& f = m.forces[k];
    patch.points[k].force = f.last.x();
    patch.points[k].mean_force = f.mean.x();
    last.head<2>() += f.last.tail<2>();
    mean.head<2>() += f.mean.tail<2>();
  }
  patch.force_t = last.x();
  patch.force_k = last.y();
  patch.torque_n = last.z();
  patch.mean_friction = mean;
}

/// The patch's friction is shared out by the points' normal forces.
void tell_forces(const ContactPatch& patch, const ContactInterval& interval, PlacedManifold& m) {
  Real sum = 0;
  for (uint32_t k = 0; k < patch.count; ++k) sum += patch.points[k].force;
  for (uint32_t k = 0; k < patch.count; ++k) {
    const ContactPatch::Point& p = patch.points[k];
    const Real share = sum > 0 ? p.force / sum : 1.0 / patch.count;
    PointForce& f = m.forces[k];
    f.now = Vec3(p.impulse, share * patch.friction_impulse.x(), share * patch.friction_impulse.y()) /
            interval.duration;
    if (!interval.is_whole) continue;
    f.last = {p.force, share * patch.force_t, share * patch.force_k};
    f.mean = {p.mean_force, share * patch.mean_friction.x(), share * patch.mean_friction.y()};
  }
  if (!interval.is_whole) return;
  m.torque = patch.torque_n;
  m.mean_torque = patch.mean_friction.z();
}

void move(Body& body, const RelaxedBody& b) {
  displace(body, b.displacement, b.rotation_vector);
  RigidBody& r = body.rigid;
  r.momentum += b.impulse;
  r.angular_momentum += b.angular_impulse;
}

}  // namespace

void FastContacts::collect(std::span<const Island* const> islands) {
  members_.clear();
  origins_.clear();
  const auto add = [this](Body& body) {
    members_.push_back(&body);
    return static_cast<uint32_t>(members_.size() - 1);
  };
  for (const Island* island : islands)
    for (Body* body : island->bodies) body->row = add(*body);
  moved_ = members_.size();
  for (const Island* island : islands)
    for (ContactPair* pair : island->pairs) {
      if (pair->by_event && pair->separation() > kTouching) continue;
      const uint32_t a = pair->a().is_awake() ? pair->a().row : add(pair->a());
      const uint32_t b = pair->b().is_awake() ? pair->b().row : add(pair->b());
      for (PlacedManifold& m : pair->manifolds()) origins_.push_back({pair, &m, a, b});
    }
}

ContactWork FastContacts::solve(std::span<const Island* const> islands, const ContactInterval& interval) {
  const Real h = interval.duration;
  collect(islands);
  joints_.collect(islands, interval);
  if (origins_.empty() && joints_.bounded().empty()) return {};
  bodies_.resize(members_.size());
  patches_.resize(origins_.size());
  for_each_interval(members_, [&](std::size_t i) { bodies_[i] = relaxed(*members_[i], interval); });
  for_each_index(patches_.size(), [&](std::size_t i) {
    const auto& [pair, manifold, a, b] = origins_[i];
    patches_[i].a = a;
    patches_[i].b = b;
    set_patch(patches_[i], *pair, *manifold, interval);
  });
  RelaxedJoints relaxed_joints(joints_.problem(), joints_.articulations(), joints_.bounded_ends());
  ContactWork work = solver_.solve(bodies_, patches_, {h, relaxation_substeps(h)}, &relaxed_joints);
  work.solves = islands.size();
  joints_.tell(h);
  for_each_index(patches_.size(),
                 [&](std::size_t i) { tell_forces(patches_[i], interval, *origins_[i].manifold); });
  std::size_t first = 0;
  for (const Island* island : islands) {
    const std::span<RelaxedBody> own = std::span(bodies_).subspan(first, island->bodies.size());
    first += own.size();
    const Real share = kept_share(*island, own);
    if (share == 1) continue;
    ++work.softened;
    for (RelaxedBody& b : own) b.scale(share);
  }
  for_each_interval(std::span(members_).first(moved_),
                    [&](std::size_t i) { move(*members_[i], bodies_[i]); });
  return work;
}

// Collisions

namespace {

/// So many contacts always collide together; more than kCluster, or after more than kGrowths extensions, only
/// when asked for.
constexpr std::size_t kSmallCluster = 40, kCluster = 100;
constexpr int kGrowths = 2;
/// What an update of a contact, and a product of a dense factorization take [ns].
constexpr Real kContactUpdate = 60, kDenseProduct = 0.7;

std::vector<std::size_t> indices_of(std::span<const uint8_t> marks) {
  std::vector<std::size_t> marked;
  for (std::size_t i = 0; i < marks.size(); ++i)
    if (marks[i]) marked.push_back(i);
  return marked;
}

/// Contacts of an island that collide together, with the bodies' velocities before.
struct CollisionCluster {
  std::vector<ContactBody> bodies;
  std::vector<Contact> contacts;
  std::vector<Real> restitution;
  std::vector<uint8_t> bounces;           // by contact
  std::vector<const ContactPair*> pairs;  // by contact

  void add(const ContactPair& pair, Real reach, Real collision_speed, ImpactLaw law) {
    const auto row = [&](const Body& body) {
      if (body.is_awake()) return body.row;
      bodies.push_back({});
      if (body.is_kinematic()) {
        bodies.back().velocity = body.drive.velocity;
        bodies.back().angular_velocity = body.drive.angular_velocity;
      }
      return static_cast<uint32_t>(bodies.size() - 1);
    };
    const uint32_t a = row(pair.a()), b = row(pair.b());
    const Vec3 surface = surface_velocity(pair);
    for (const PlacedManifold& m : pair.manifolds())
      for (uint32_t k = 0; k < m.manifold.count; ++k) {
        const ContactPoint& point = m.manifold.points[k];
        if (point.separation > reach) continue;
        const Vec3 place = (point.on_a + point.on_b) / 2;
        Contact c{.a = a, .b = b, .frame = m.frame};
        c.arm_a = place - origin(pair.a());
        c.arm_b = place - origin(pair.b());
        c.offset = in_frame(m.frame, surface);
        const Vec3 u = c.relative_velocity(bodies);
        std::tie(c.friction_t, c.friction_k) = friction(pair.surface(), u);
        contacts.push_back(c);
        pairs.push_back(&pair);
        bounces.push_back(u.x() < -collision_speed);
        // In sequence, a contact at rest may be hit by the impulse of another.
        restitution.push_back(bounces.back() || law == ImpactLaw::sequential ? pair.surface().restitution
                                                                             : 0);
      }
  }

  /// Adds contacts to those that collide together, and all that share a moved body with one of them.
  void take(std::span<const std::size_t> wanted, std::vector<uint8_t>& taken) const {
    std::vector<uint8_t> involved(bodies.size(), 0);
    for (const std::size_t i : wanted)
      for (const uint32_t body : {contacts[i].a, contacts[i].b}) involved[body] |= bodies[body].is_moved();
    for (std::size_t i = 0; i < contacts.size(); ++i)
      if (involved[contacts[i].a] || involved[contacts[i].b]) taken[i] = 1;
  }
};

/// Collides the contacts of a large cluster that the impact reaches: those around what bounces, then also
/// those that their impulses make approach faster than `speed` and all around these, until nothing else does.
/// What is left out has no impulse, which is then its solution. A cluster that grows beyond kCluster
/// contacts, or too often, is cut off; what is left out of it blocks the way afterwards, as resting contact.
ContactWork collide_reached(CollisionCluster& cluster, Real speed, ImpactLaw law,
                            const JointProblem& joints) {
  std::vector<uint8_t> taken(cluster.contacts.size(), 0);
  std::vector<std::size_t> wanted = indices_of(cluster.bounces);
  const std::vector<ContactBody> before = cluster.bodies;
  ContactWork work;
  for (int round = 0; !wanted.empty(); ++round) {
    cluster.take(wanted, taken);
    const std::vector<std::size_t> together = indices_of(taken);
    std::vector<Contact> contacts;
    std::vector<Real> restitution;
    for (const std::size_t i : together) {
      contacts.push_back(cluster.contacts[i]);
      restitution.push_back(cluster.restitution[i]);
    }
    cluster.bodies = before;
    const ContactWork one = collide_roughly(cluster.bodies, contacts, restitution, law, joints);
    work.add(one);
    work.solves = 1;
    work.fallbacks = one.fallbacks;
    work.residual = one.residual;
    for (std::size_t k = 0; k < together.size(); ++k)
      cluster.contacts[together[k]].impulse = contacts[k].impulse;
    wanted.clear();
    for (std::size_t i = 0; i < taken.size(); ++i)
      if (!taken[i] && cluster.contacts[i].relative_velocity(cluster.bodies).x() < -speed)
        wanted.push_back(i);
    if (wanted.empty()) break;
    if (together.size() > kCluster || round == kGrowths) {
      work.narrowed = 1;
      break;
    }
  }
  return work;
}

}  // namespace

CollisionOutcome resolve_collisions(const Island& island, const CollisionSettings& settings) {
  CollisionCluster cluster;
  for (Body* body : island.bodies) {
    body->row = static_cast<uint32_t>(cluster.bodies.size());
    cluster.bodies.push_back({1 / body->rigid.mass, inverse_inertia(body->rigid, body->start.orientation),
                              body->start_twist.velocity, body->start_twist.angular_velocity});
  }
  for (const ContactPair* pair : island.pairs)
    cluster.add(*pair, settings.reach, settings.collision_speed, settings.law);
  CollisionOutcome outcome;
  if (cluster.contacts.empty()) return outcome;
  IslandJoints joints;
  joints.collect_for_collision(island, settings.time);
  const JointProblem problem = joints.problem();
  if (settings.whole)
    outcome.work = collide(cluster.bodies, cluster.contacts, cluster.restitution, settings.law, problem);
  else if (cluster.contacts.size() <= kSmallCluster)
    outcome.work =
        collide_roughly(cluster.bodies, cluster.contacts, cluster.restitution, settings.law, problem);
  else
    outcome.work = collide_reached(cluster, settings.collision_speed, settings.law, problem);
  outcome.cost = static_cast<Real>(outcome.work.iterations * cluster.contacts.size()) * kContactUpdate +
                 static_cast<Real>(outcome.work.factorizations) *
                     std::pow(3.0 * static_cast<Real>(std::min(cluster.contacts.size(), kSmallCluster)), 3) *
                     kDenseProduct;
  if (outcome.work.fallbacks > 0)
    if (const auto worst = worst_contact(cluster.bodies, cluster.contacts))
      outcome.rough = cluster.pairs[*worst];
  for (Body* body : island.bodies) {
    const ContactBody& b = cluster.bodies[body->row];
    body->set_start_velocity(b.velocity, b.angular_velocity);
  }
  joints.tell_blows();
  outcome.bounces = static_cast<uint32_t>(std::count(cluster.bounces.begin(), cluster.bounces.end(), 1));
  return outcome;
}

}  // namespace offstage::sim
