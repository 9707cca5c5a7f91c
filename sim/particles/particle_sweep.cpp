#include "sim/particles/particle_sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/collision/sphere_sweep.h"
#include "sim/contact/collision.h"

namespace offstage::sim {
namespace {

/// Distance from surfaces at which particles are kept [m]: far above rounding (1e-13 at 1000 m) and invisibly
/// small. A hit is detected at half of this distance. So a particle that slides along a surface, exactly up
/// to rounding, does not hit it.
constexpr Real kSkin = 1e-10;
constexpr int kMaxHits = 8;
/// The part of a particle's radius around its centre that must not pass cloth in any case.
constexpr Real kNarrow = 1e-3;
/// Greatest number of projections out of bodies; each removes one layer of overlapping bodies.
constexpr int kMaxEjections = 4;
/// Overlaps up to this fraction of the particle's radius can be caused by dividing paths around turning
/// bodies into straight pieces.
constexpr Real kDriftDepth = Obstacle::kChordError;
/// Number of passes over simultaneous contacts. Two contacts at right angles need only one pass.
constexpr int kContactPasses = 8;

/// Whether a sphere, in the solid's frame, certainly does not touch the solid.
bool is_clear(const Solid& solid, const Vec3& centre, Real radius) {
  return solid.mesh && solid.mesh->clearance_grid().is_clear(centre, radius);
}

}  // namespace

SpherePath::SpherePath(const Vec3& a, const Vec3& b, Real from, const Obstacle* carrier)
    : a_(a), b_(b), from_(from), carrier_(carrier) {
  if (!carrier) return;
  local_a_ = carrier->at(from).point_to_body(a);
  local_b_ = carrier->at(1).point_to_body(b);
}

Vec3 SpherePath::at(Real fraction) const {
  if (!carrier_) return a_ + fraction * (b_ - a_);
  return carrier_->at(time(fraction)).point_to_world(local_a_ + fraction * (local_b_ - local_a_));
}

Vec3 SpherePath::in_frame(const Obstacle& o, Real fraction) const {
  if (&o == carrier_) return local_a_ + fraction * (local_b_ - local_a_);
  return o.at(time(fraction)).point_to_body(at(fraction));
}

int SpherePath::pieces(const Obstacle& o, Real radius) const {
  if (&o == carrier_) return 1;
  return carrier_ ? std::max(o.pieces(radius), carrier_->pieces(radius)) : o.pieces(radius);
}

Real SpherePath::bend() const {
  // The path of a point that turns by less than half a turn is closest to its chord's middle in the middle.
  return carrier_ ? 1.1 * (at(0.5) - (a_ + b_) / 2).norm() : 0;
}

SweepOutcome ParticleSweep::operator()(ParticlePath& path, Real born, const Vec3& extra) {
  const Vec3 start = path.start;
  const SweepOutcome outcome = sweep(path, born, extra);
  // Where bodies and several layers of cloth push a particle, its centre still stays on its side of the
  // cloth.
  if (cloths_ && outcome.hit && !outcome.strikes_body)
    path.end = cloths_->held_end(start, path.end, kNarrow * path.radius, born);
  return outcome;
}

SweepOutcome ParticleSweep::sweep(ParticlePath& path, Real born, const Vec3& extra) {
  SweepOutcome outcome;
  contact_count_ = 0;
  cloth_contact_count_ = 0;
  carrier_ = nullptr;
  reactions_before_finish_ = log_.reactions.size();
  near_.find(path.start, path.end, path.radius);
  if (near_.all().empty() && !cloths_) return outcome;
  if (!eject(path, born, outcome)) {
    outcome.trapped = true;
    return outcome;
  }
  Real from = born;
  ObstacleHit hit;
  std::optional<ClothObstacles::Hit> cloth;
  for (int hits = 0; hits < kMaxHits; ++hits) {
    const SpherePath rest(path.start, path.end, from, carrier_);
    if (hits > 0) near_.find(rest, path.radius);
    hit = near_.first_hit(rest, path.radius);
    cloth.reset();
    if (cloths_)
      cloth = cloths_->first_hit(path.start, path.end, path.radius, from, hit.obstacle ? hit.fraction : 1);
    if (!hit.obstacle && !cloth) {
      for (const ClothContact& c : cloth_contacts()) cloths_->push(c.hit, -c.impulse);
      return outcome;
    }
    outcome.hit = true;
    if (!(cloth ? respond(path, *cloth, from, extra, outcome) : respond(path, hit, from, extra, outcome)))
      return outcome;
    from = cloth ? cloth->fraction : hit.fraction;
  }
  // The particle moves on with what it hit last, which would otherwise pass over it.
  outcome.truncated = true;
  const Vec3 held = cloth ? path.start : PlaneAtEnd(hit).origin;
  path.end = cloths_ ? cloths_->held_end(path.start, held, path.radius, from) : held;
  return outcome;
}

/// Projects the particle out of bodies, but not through cloth. Returns false if this fails.
bool ParticleSweep::eject(ParticlePath& path, Real born, SweepOutcome& outcome) {
  if (near_.all().empty()) return true;
  const Vec3 start = path.start, end = path.end;
  if (!near_.eject(path.start, path.end, path.radius, born, outcome.ejected)) return false;
  if (!cloths_ || path.start == start || !cloths_->separates(start, path.start, born)) return true;
  path.start = start;
  path.end = end;
  return true;
}

void NearObstacles::find(const SpherePath& path, Real radius) {
  near_.clear();
  const Vec3 &a = path.first(), &b = path.last();
  const auto add = [&](const Obstacle& o) { near_.push_back(&o); };
  const Real around = radius + kSkin + path.bend(), reach = around + (b - a).norm();
  fixed_.near_path(a, b, around, [&](const Obstacle& o) {
    if (!is_clear(o.solid, o.start.point_to_body(a), reach)) add(o);
  });
  moving_.near_path(a, b, around, add);
}

bool NearObstacles::eject(Vec3& start, Vec3& end, Real radius, Real fraction, bool& deep) {
  for (int round = 0; round <= kMaxEjections; ++round) {
    bool clear = true;
    for (const Obstacle* o : near_) {
      const Pose pose = o->at(fraction);
      const Vec3 centre = pose.point_to_body(start);
      if (is_clear(o->solid, centre, radius)) continue;
      const SurfaceDistance s = signed_distance_below(o->solid, centre, radius);
      if (s.distance >= radius) continue;
      if (round == kMaxEjections) return false;
      clear = false;
      deep |= radius - s.distance > kDriftDepth * radius;
      const Vec3 out = (radius + kSkin - s.distance) * pose.vector_to_world(s.normal);
      start += out;
      end += out;
    }
    if (clear) return true;
    find(start, end, radius);
  }
  return false;
}

ObstacleHit NearObstacles::first_hit(const SpherePath& path, Real radius) const {
  ObstacleHit first;
  for (const Obstacle* o : near_) {
    const ObstacleHit found =
        hit(*o, path, radius, first.obstacle ? first.fraction : std::numeric_limits<Real>::infinity());
    if (found.obstacle) first = found;
  }
  return first;
}

ObstacleHit NearObstacles::hit(const Obstacle& o, const SpherePath& path, Real radius, Real latest) {
  const int pieces = path.pieces(o, radius);
  Vec3 p = path.in_frame(o, 0);
  for (int k = 0; k < pieces; ++k) {
    const Vec3 q = path.in_frame(o, static_cast<Real>(k + 1) / pieces);
    if (const auto hit = sweep_sphere(o.solid, p, q, radius + kSkin / 2)) {
      const Real fraction = path.time((k + hit->fraction) / pieces);
      if (fraction >= latest) return {};
      const Pose pose = o.at(fraction);
      const Vec3 local = p + hit->fraction * (q - p) + (radius + kSkin - hit->distance) * hit->normal;
      return {&o, fraction, pose.point_to_world(local), pose.vector_to_world(hit->normal)};
    }
    p = q;
  }
  return {};
}

/// Whether the particle already hit this obstacle in this sub-step. The obstacle moves by the impulse only
/// from the next sub-step on.
bool ParticleSweep::was_struck(const Obstacle& o) const {
  return std::any_of(contacts_.begin(), contacts_.begin() + static_cast<std::ptrdiff_t>(contact_count_),
                     [&](const Contact& c) { return c.gives_way && c.obstacle == &o; });
}

/// Returns the velocity after free flight. It is exact for constant forces without drag, and accurate to
/// second order in the drag.
Vec3 ParticleSweep::fly(const Vec3& v, Real mass, Real duration, const Vec3& extra) const {
  return v + DampedKick(duration, forces_.drag / mass).end * (forces_.acceleration(v, mass) + extra);
}

/// Returns the velocity with which the particle arrives at a hit, `duration` after the start of its path.
Vec3 ParticleSweep::arrival(const ParticlePath& path, const Vec3& position, Real duration,
                            const Vec3& extra) const {
  const Vec3 v = fly(path.start_velocity, path.mass, duration, extra);
  return velocity_after_shift(v, forces_.acceleration(v, path.mass) + extra,
                              position - path.start - duration / 2 * (path.start_velocity + v));
}

/// Moves the particle to the hit, applies the impulse (P5), and integrates the rest of its path. Returns
/// false without moving the particle if it hits a dynamic body whose impulses the caller does not accept:
/// other particles may hit this body earlier.
bool ParticleSweep::respond(ParticlePath& path, const ObstacleHit& hit, Real from, const Vec3& extra,
                            SweepOutcome& outcome) {
  const Obstacle& o = *hit.obstacle;
  const Real friction = std::sqrt(path.friction * o.friction);
  log_.reactions.resize(reactions_before_finish_);
  Vec3 v = arrival(path, hit.position, (hit.fraction - from) * h_, extra);
  const Vec3 acceleration = forces_.acceleration(v, path.mass) + extra;
  Vec3 u = v - o.velocity_at(hit.position, hit.fraction);
  Real approach = -u.dot(hit.normal);
  const Real pressing = -acceleration.dot(hit.normal);
  const Real gain = pressing * h_;  // speed of approach that the forces would restore within one sub-step
  Real restitution = std::max(path.restitution, o.restitution);
  const bool strikes = approach > std::max(gain, 0.0);
  // Only impacts move the obstacle here; the load of resting particles is added separately.
  const bool moves_it = strikes && o.is_dynamic(), moved_it = was_struck(o);
  const Vec3 contact = hit.position - path.radius * hit.normal;
  Mat3 mobility = Mat3::Zero();
  if (moves_it && !moved_it) {
    if (!impulses_) {
      outcome.strikes_body = true;
      outcome.time = hit.fraction;
      return false;
    }
    const Vec3 arm = contact - o.centre_at(hit.fraction);
    u = v - impulses_->velocity(o, arm);
    approach = -u.dot(hit.normal);
    mobility = impulses_->mobility(o, arm, -hit.normal);
  }
  // A bounce lasts 2 e u / a. A bounce that ends within the sub-step belongs to the tail of an infinite
  // series (E6, Zeno).
  if (2 * restitution * approach < gain) restitution = 0;
  if (approach > 0 && !moved_it) {
    const Vec3 impulse =
        collision_impulse(o, hit.fraction, path.mass, u, hit.normal, restitution, friction, mobility);
    v += impulse / path.mass;
    const Reaction back = reaction(o, contact, hit.fraction, impulse);
    if (moves_it)
      impulses_->push(back);
    else if (o.is_dynamic())
      log_.reactions.push_back(back);
  }
  if (strikes && !moved_it) {
    ++outcome.collisions;
    if (log_.wants_strikes) log_.strikes.push_back({hit.fraction, hit.position, v, hit.normal});
  }
  const bool gives_way = moves_it || moved_it, stays = restitution == 0 || gives_way;
  if (stays) add_contact({hit.normal, PlaneAtEnd(hit), &o, friction, hit.fraction, gives_way});
  carrier_ = stays && !gives_way && o.turn > 0 ? &o : nullptr;
  path.start = hit.position;
  path.start_velocity = v;
  reactions_before_finish_ = log_.reactions.size();
  finish(path, (1 - hit.fraction) * h_, extra);
  return true;
}

/// The same for a hit on cloth. The cloth moves by the impulse only from the next sub-step on; until then it
/// takes the particle along.
bool ParticleSweep::respond(ParticlePath& path, const ClothObstacles::Hit& hit, Real from, const Vec3& extra,
                            SweepOutcome& outcome) {
  if (!impulses_) {
    outcome.strikes_body = true;
    outcome.time = hit.fraction;
    return false;
  }
  log_.reactions.resize(reactions_before_finish_);
  Vec3 v = arrival(path, hit.position, (hit.fraction - from) * h_, extra);
  const Real gain = -h_ * (forces_.acceleration(v, path.mass) + extra).dot(hit.normal);
  const ClothObstacles::Impact impact =
      cloths_->collide(hit, v, {path.mass, path.restitution, path.friction}, gain);
  v += impact.impulse / path.mass;
  if (impact.strikes) {
    ++outcome.collisions;
    if (log_.wants_strikes) log_.strikes.push_back({hit.fraction, hit.position, v, hit.normal});
  }
  add_contact(ClothContact{hit, !impact.bounces});
  carrier_ = nullptr;
  path.start = hit.position;
  path.start_velocity = v;
  reactions_before_finish_ = log_.reactions.size();
  finish(path, (1 - hit.fraction) * h_, extra);
  return true;
}

/// Adds a contact with cloth. It replaces the contact with the same triangle or, if there are too many, the
/// oldest one.
void ParticleSweep::add_contact(const ClothContact& contact) {
  const auto end = cloth_contacts_.begin() + static_cast<std::ptrdiff_t>(cloth_contact_count_);
  auto old = std::find_if(cloth_contacts_.begin(), end,
                          [&](const ClothContact& c) { return c.hit.triangle == contact.hit.triangle; });
  if (old == end && cloth_contact_count_ < cloth_contacts_.size()) {
    cloth_contacts_[cloth_contact_count_++] = contact;
    return;
  }
  if (old == end) old = cloth_contacts_.begin();
  std::move(old + 1, end, old);
  cloth_contacts_[cloth_contact_count_ - 1] = contact;
}

/// Cancels the velocity at which forces press a particle against cloth at the end of the sub-step. Returns
/// whether they do.
bool ParticleSweep::press_cloth(ClothContact& contact, Vec3& v, Real mass, Real friction) const {
  const ClothObstacles::Hit& hit = contact.hit;
  const Vec3 u = v - cloths_->velocity(hit);
  if (!contact.presses || u.dot(hit.normal) >= 0) return false;
  const Vec3 impulse = cloths_->impulse(hit, u, {mass, 0, friction});
  contact.impulse += impulse;
  v += impulse / mass;
  return true;
}

/// Keeps the end of the path off the cloth that the particle has hit, along the normals there.
void ParticleSweep::keep_off_cloth(ParticlePath& path, const Vec3& extra) {
  Vec3 shift = Vec3::Zero();
  for (int pass = 0; pass < kContactPasses; ++pass) {
    bool behind_any = false;
    for (const ClothContact& c : cloth_contacts()) {
      const Vec3 at = c.hit.position - c.hit.distance * c.hit.normal + cloths_->displacement(c.hit);
      const Real behind =
          ClothObstacles::kept_distance(path.radius) - c.hit.normal.dot(path.end + shift - at);
      if (behind > 0) shift += behind * c.hit.normal;
      behind_any |= behind > 0;
    }
    if (!behind_any || cloth_contact_count_ == 1) break;
  }
  if (shift.isZero(0)) return;
  path.end += shift;
  path.end_velocity = velocity_after_shift(path.end_velocity,
                                           forces_.acceleration(path.end_velocity, path.mass) + extra, shift);
}

/// Adds a contact. If there are too many, the oldest one is dropped, because it is least important at the
/// current position.
void ParticleSweep::add_contact(const Contact& contact) {
  if (contact_count_ == contacts_.size()) {
    std::move(contacts_.begin() + 1, contacts_.end(), contacts_.begin());
    --contact_count_;
  }
  contacts_[contact_count_++] = contact;
}

/// Moves the particle for the remaining time. An impulse without restitution cancels forces that would push
/// it into a surface on which it rests. Divided by the time, this impulse is the normal force and Coulomb
/// friction.
void ParticleSweep::finish(ParticlePath& path, Real duration, const Vec3& extra) {
  Vec3 v = fly(path.start_velocity, path.mass, duration, extra);
  const Vec3 predicted = path.start + duration * path.start_velocity;
  const auto press = [&](const Contact& c) {
    if (c.gives_way) return false;
    const Vec3 u = v - c.obstacle->velocity_at(predicted, 1);
    const Vec3& normal = c.plane.normal;
    if (u.dot(normal) >= 0) return false;
    const Vec3 impulse = collision_impulse(*c.obstacle, 1, path.mass, u, normal, 0, c.friction, Mat3::Zero());
    v += impulse / path.mass;
    if (c.obstacle->is_dynamic())
      log_.reactions.push_back(
          reaction(*c.obstacle, path.start - path.radius * c.normal, c.fraction, impulse));
    return true;
  };
  for (ClothContact& c : cloth_contacts()) c.impulse.setZero();
  for (int pass = 0; pass < kContactPasses; ++pass) {
    bool pressed = false;
    for (std::size_t i = 0; i < contact_count_; ++i) pressed |= press(contacts_[i]);
    for (ClothContact& c : cloth_contacts()) pressed |= press_cloth(c, v, path.mass, path.friction);
    if (!pressed || contact_count_ + cloth_contact_count_ == 1) break;
  }
  path.end_velocity = v;
  path.end = path.start + duration / 2 * (path.start_velocity + v);
  if (cloth_contact_count_ > 0) keep_off_cloth(path, extra);
  for (std::size_t i = 0; i < contact_count_; ++i) {
    const Contact& c = contacts_[i];
    // A surface that turns moves on an arc, and the particle on a straight line, so that the particle may end
    // below the surface although it does not approach it.
    if (c.gives_way)
      stay_before(c, path, duration, extra);
    else if (c.obstacle->turn > 0)
      path.end -= std::min(c.plane.height(path.end), 0.0) * c.plane.normal;
  }
}

/// Keeps the end of a path in front of an obstacle that gives way only in the next sub-step.
void ParticleSweep::stay_before(const Contact& c, ParticlePath& path, Real duration,
                                const Vec3& extra) const {
  const Vec3 behind = duration * c.obstacle->velocity_at(path.start, 1) - (path.end - path.start);
  if (!(behind.dot(c.normal) > 0)) return;
  const Vec3 shift = behind.dot(c.normal) * c.normal;
  path.end += shift;
  path.end_velocity = velocity_after_shift(path.end_velocity,
                                           forces_.acceleration(path.end_velocity, path.mass) + extra, shift);
}

PlaneAtEnd::PlaneAtEnd(const ObstacleHit& hit) {
  const Obstacle& o = *hit.obstacle;
  if (o.turn == 0) {
    origin = hit.position + (1 - hit.fraction) * (o.end.position - o.start.position);
    normal = hit.normal;
    return;
  }
  const Pose then = o.at(hit.fraction), end = o.at(1);
  origin = end.point_to_world(then.point_to_body(hit.position));
  normal = end.vector_to_world(then.vector_to_body(hit.normal));
}

Vec3 collision_impulse(const Obstacle& o, Real fraction, Real particle_mass, const Vec3& u, const Vec3& n,
                       Real restitution, Real friction, const Mat3& mobility, Real turning) {
  const Vec3 sliding = u - o.conveying_velocity(n, fraction);
  const Vec3 friction_axis = o.friction_axis_on(n, fraction);
  const bool isotropic = friction_axis.isZero();
  if (mobility.isZero(0) && isotropic)
    return collision_impulse(particle_mass, particle_mass / (1 + turning), sliding, n, restitution, friction);
  const ContactFrame f =
      isotropic ? contact_frame(n) : ContactFrame{n, friction_axis, n.cross(friction_axis)};
  Mat3 axes;
  axes << f.n, f.t, f.k;
  Mat3 K = Mat3::Identity() / particle_mass + mobility;
  if (turning > 0) K += turning / particle_mass * (Mat3::Identity() - n * n.transpose());
  return axes * collision_impulse(Mat3(axes.transpose() * K * axes), Vec3(axes.transpose() * sliding),
                                  restitution, friction, isotropic ? friction : o.cross_friction * friction);
}

Reaction reaction(const Obstacle& o, const Vec3& contact, Real fraction, const Vec3& impulse_on_particle) {
  return {o.body, -impulse_on_particle, (o.centre_at(fraction) - contact).cross(impulse_on_particle)};
}

}  // namespace offstage::sim
