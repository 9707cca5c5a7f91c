#include "sim/contact/fast_contacts.h"

#include <algorithm>
#include <tuple>

#include "sim/contact/contact_motion.h"
#include "sim/contact/contact_terms.h"
#include "sim/contact/energy_guard.h"
#include "sim/core/parallel_loop.h"

namespace offstage::sim {
namespace {

/// Separation of points that must not push [m].
constexpr Real kOutOfReach = 1e3;

/// A gap that the speed at the interval's start closes within this multiple of the interval may be closed at
/// the interval's end, because the bodies are accelerated or turn.
constexpr Real kNearTime = 2;

/// Whether points of a body can be left out of a step that will be traced back to the body's next impact. Two
/// kinds of bodies do not allow this. If a body has several pieces, a piece without a known point may touch
/// first. A thin body may spin far in the rest of the sub-step.
bool waits_for_impacts(Body& body) {
  const CollisionShape& shape = body.collision_shape();
  return (shape.is_plane() || shape.piece_count() == 1) && !(body.is_dynamic() && body.rigid.is_thin());
}

RelaxedBody relaxed(const Body& body, const ContactInterval& interval) {
  RelaxedBody b;
  const Real duration = interval.duration;
  if (body.is_awake()) {
    b.inverse_mass = 1 / body.rigid.mass;
    b.inverse_inertia = inverse_inertia(body.rigid, body.impulse_orientation(duration, interval.substep));
    b.velocity = body.start_twist.velocity;
    b.angular_velocity = body.start_twist.angular_velocity;
    b.free_acceleration = (body.rigid.velocity() - b.velocity) / duration;
    b.free_angular_acceleration = (body.rigid.angular_velocity() - b.angular_velocity) / duration;
  } else if (body.is_kinematic()) {
    b.velocity = body.drive.velocity;
    b.angular_velocity = body.drive.angular_velocity;
    if (!interval.is_whole) return b;
    // The acceleration is constant, and leads to the pose and the velocity at the end.
    const Vec3 mean = (body.pose.position - body.start_pose.position) / duration;
    const Vec3 mean_spin = rotation_vector(body.start_pose.orientation, body.pose.orientation) / duration;
    b.free_acceleration = 2 / duration * (b.velocity - mean);
    b.free_angular_acceleration = 2 / duration * (b.angular_velocity - mean_spin);
    b.velocity = 2 * mean - b.velocity;
    b.angular_velocity = 2 * mean_spin - b.angular_velocity;
  }
  return b;
}

/// Returns the change of a body's velocity by its free motion in the interval [m/s].
Vec3 free_change(const Body& body) {
  return body.is_awake() ? Vec3(body.rigid.velocity() - body.start_twist.velocity) : Vec3(Vec3::Zero());
}

/// Returns the mean time from the interval's start at which the impulses of a manifold act [s]. A contact
/// that touched before acts throughout. A new one closes at the time t with the speed of approach u, and then
/// resists the acceleration a of the free approach until the end.
Real acting_time(const ContactPair& pair, const PlacedManifold& m, Real duration) {
  // The inertia of a thin body belongs to the middle (Body::impulse_orientation). The moment of an impulse
  // with the arm of another time would spin it about its axis.
  for (const Body* body : {&pair.a(), &pair.b()})
    if (body->is_dynamic() && body->rigid.is_thin()) return duration / 2;
  Real closing = kNearTime * duration, approach = 0;
  for (uint32_t k = 0; k < m.manifold.count; ++k) {
    if (m.forces[k].last.x() > 0) return duration / 2;
    const ContactPoint& point = m.manifold.points[k];
    const Real speed = -pair.relative_velocity((point.on_a + point.on_b) / 2).dot(m.frame.n);
    const Real gap = std::max(point.separation, 0.0);
    if (!(gap < closing * speed)) continue;
    closing = gap / speed;
    approach = speed;
  }
  if (approach == 0) return duration / 2;
  closing = std::min(closing, duration);
  const Real rest = duration - closing;
  const Real press =
      std::max(0.0, (free_change(pair.b()) - free_change(pair.a())).dot(m.frame.n)) * rest / duration;
  return (approach * closing + press * (closing + rest / 2)) / (approach + press);
}

/// The motion of a contact in the interval, and its place at the time at which its impulses act.
struct ActingMotion {
  ContactMotion motion;
  ContactPlace place;
  ContactFrame frame;
  Real time = 0;  // from -1 at the interval's start to 1 at its end
};

/// Predicts the motion of a patch's contact; see contact_motion(). With the arms of another time than that of
/// the impulses, the impulses on the two bodies would not act at the same place, and would change the angular
/// momentum.
ActingMotion acting_motion(const ContactPair& pair, const PlacedManifold& m, const Vec3& place, Real gap,
                           const ContactInterval& interval) {
  const Body &a = pair.a(), &b = pair.b();
  const Real duration = interval.duration, time = acting_time(pair, m, duration);
  ActingMotion acting{.motion =
                          contact_motion(a, b, m.manifold, m.frame, place, gap, duration, interval.substep)};
  acting.place = acting.motion.middle;
  acting.frame = acting.motion.frame;
  if (time == duration / 2) return acting;
  acting.place = contact_place(a, b, m.manifold, place, gap, time, interval.substep);
  acting.frame = turned_frame(m.frame, acting.place.normal);
  acting.time = 2 * time / duration - 1;
  return acting;
}

/// Sets the motion of the contact at the patch's centre, where the surfaces are `gap` apart. The points move
/// with the body that defines the contact, and lie at different heights over the other body.
void set_motion(ContactPatch& patch, const ActingMotion& acting, NormalSource source, Real gap) {
  const ContactMotion& motion = acting.motion;
  patch.arm_a = acting.place.arm_a;
  patch.arm_b = acting.place.arm_b;
  patch.turns = motion.turns;
  if (!motion.turns) return;
  const ContactFrame& f = patch.frame;
  const Real side = moves_with_b(source) ? -1 : 1;
  for (uint32_t i = 0; i < patch.count; ++i) {
    ContactPatch::Point& p = patch.points[i];
    const Vec3 arm = acting.place.turn * (p.t * f.t + p.k * f.k + side * (p.separation - gap) * f.n);
    p.t = acting.frame.t.dot(arm);
    p.k = acting.frame.k.dot(arm);
  }
  patch.frame = acting.frame;
  patch.acting = acting.time;
  patch.gain = motion.gain;
  patch.bow = motion.bow;
  patch.gain_along_t = motion.gain_along_t;
  patch.gain_along_k = motion.gain_along_k;
}

/// Sets all data of a patch from a manifold and its initial forces.
void set_patch(ContactPatch& patch, const ContactPair& pair, const PlacedManifold& m,
               const ContactInterval& interval) {
  const Real duration = interval.duration;
  const Vec3 centre_a = start_centre(pair.a()), surface = surface_velocity(pair, m.frame.n);
  // Only the deepest point of a rim shows the contact's position on the rim.
  const bool runs = runs_along(pair.a(), duration) || runs_along(pair.b(), duration);
  const Real gap = set_points(patch, m.manifold, m.frame, centre_a, start_centre(pair.b()), runs);
  const Vec3 place = centre_a + patch.arm_a;
  const Vec3 u = m.frame.components(pair.relative_velocity(place) + surface);
  set_motion(patch, acting_motion(pair, m, place, gap, interval), m.manifold.source, gap);
  patch.offset = patch.frame.components(surface);
  std::tie(patch.friction_t, patch.friction_k) = friction(pair.surface(), u);
  patch.rolling = pair.surface().rolling;
  patch.spinning = pair.surface().spinning;
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
  // The step will be traced back to the next impact of the pair. The point of this impact must not push
  // before that.
  if (!pair.needs_toi || !waits_for_impacts(pair.a()) || !waits_for_impacts(pair.b())) return;
  for (uint32_t k = 0; k < patch.count; ++k) {
    if (!pair.awaits_impact(m, m.manifold.points[k], interval.impact_speed)) continue;
    patch.points[k].separation = kOutOfReach;
    patch.points[k].force = patch.points[k].mean_force = 0;
  }
}

/// Distributes the friction of the patch over the points by their normal forces.
void store_forces(const ContactPatch& patch, const ContactInterval& interval, PlacedManifold& m) {
  Real sum = 0;
  for (uint32_t k = 0; k < patch.count; ++k) sum += patch.points[k].force;
  for (uint32_t k = 0; k < patch.count; ++k) {
    const ContactPatch::Point& p = patch.points[k];
    const Real fraction = sum > 0 ? p.force / sum : 1.0 / patch.count;
    PointForce& f = m.forces[k];
    f.now = Vec3(p.impulse, fraction * patch.friction_impulse.x(), fraction * patch.friction_impulse.y()) /
            interval.duration;
    if (!interval.is_whole) continue;
    f.last = {p.force, fraction * patch.force_t, fraction * patch.force_k};
    f.mean = {p.mean_force, fraction * patch.mean_friction.x(), fraction * patch.mean_friction.y()};
  }
  if (!interval.is_whole) return;
  m.torque = patch.torque_n;
  m.mean_torque = patch.mean_friction.z();
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
      if (pair->needs_toi && pair->separation() > kTouching) continue;
      const uint32_t a = pair->a().is_awake() ? pair->a().row : add(pair->a());
      const uint32_t b = pair->b().is_awake() ? pair->b().row : add(pair->b());
      for (PlacedManifold& m : pair->manifolds()) origins_.push_back({pair, &m, a, b});
    }
}

/// Marks the links among the bodies, and collects their contact points, grouped by articulation.
void FastContacts::collect_link_contacts() {
  link_contacts_.clear();
  if (joints_.articulations().empty()) return;
  constexpr uint32_t kNone = UINT32_MAX;
  std::vector<uint32_t> part_of(members_.size(), kNone);
  for (uint32_t i = 0; i < joints_.articulations().size(); ++i)
    for (const Body* body : joints_.articulations()[i]->bodies()) {
      part_of[body->row] = i;
      bodies_[body->row].is_link = true;
    }
  for (uint32_t k = 0; k < patches_.size(); ++k) {
    const ContactPatch& p = patches_[k];
    const uint32_t part = std::min(part_of[p.a], part_of[p.b]);
    if (part == kNone) continue;
    for (uint32_t i = 0; i < p.count; ++i) {
      const Vec3 place = p.points[i].t * p.frame.t + p.points[i].k * p.frame.k;
      LinkContact c{.part = part, .patch = k, .point = i, .row = {}, .separation = p.points[i].separation};
      c.row.a = p.a;
      c.row.b = p.b;
      c.row.on_a << p.frame.n, (p.arm_a + place).cross(p.frame.n);
      c.row.on_b << -p.frame.n, -(p.arm_b + place).cross(p.frame.n);
      link_contacts_.push_back(c);
    }
  }
  std::stable_sort(link_contacts_.begin(), link_contacts_.end(),
                   [](const LinkContact& x, const LinkContact& y) { return x.part < y.part; });
}

ContactWork FastContacts::solve(std::span<const Island* const> islands, const ContactInterval& interval) {
  const Real h = interval.duration;
  collect(islands);
  joints_.collect(islands, interval, IslandJoints::Springs::constraints);
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
  collect_link_contacts();
  RelaxedJoints relaxed_joints(joints_.problem(), joints_.articulations(), joints_.bounded_ends(),
                               link_contacts_);
  ContactWork work = solver_.solve(bodies_, patches_, {h, relaxation_substeps(h)}, &relaxed_joints);
  work.solves = islands.size();
  joints_.store_impulses(h);
  for (const LinkContact& c : link_contacts_) patches_[c.patch].points[c.point].impulse += c.row.impulse;
  for_each_index(patches_.size(),
                 [&](std::size_t i) { store_forces(patches_[i], interval, *origins_[i].manifold); });
  std::size_t first = 0;
  for (const Island* island : islands) {
    const std::span<RelaxedBody> own = std::span(bodies_).subspan(first, island->bodies.size());
    first += own.size();
    const Real fraction = kept_fraction(*island, own);
    if (fraction == 1) continue;
    ++work.restitution_reduced;
    for (RelaxedBody& b : own) b.scale(fraction);
  }
  for_each_interval(std::span(members_).first(moved_), [&](std::size_t i) {
    const RelaxedBody& b = bodies_[i];
    add_effect(
        *members_[i],
        {b.impulse, b.angular_impulse, b.inverse_inertia * members_[i]->rigid.angular_momentum,
         b.inverse_inertia * b.angular_impulse, b.displacement, b.rotation_vector, h / interval.substep});
  });
  return work;
}

}  // namespace offstage::sim
