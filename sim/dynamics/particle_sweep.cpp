#include "sim/dynamics/particle_sweep.h"

#include <algorithm>
#include <cmath>

#include "sim/collision/sphere_sweep.h"

namespace offstage::sim {
namespace {

/// Particles are kept this far off surfaces [m], far above rounding (1e-13 at 1000 m) and far below anything
/// seen. A hit is declared at half of it, so that sliding along a surface, exact up to rounding, is not a
/// hit.
constexpr Real kSkin = 1e-10;
constexpr int kMaxHits = 8;
/// Rounds of projection out of bodies; each clears one layer of overlapping bodies.
constexpr int kMaxEjections = 4;
/// Overlap, relative to the radius, that only the straightening of paths around turning bodies can make.
constexpr Real kDriftDepth = Obstacle::kChordError;
/// Passes over simultaneous contacts; two at right angles need one.
constexpr int kContactPasses = 8;

}  // namespace

SweepOutcome ParticleSweep::operator()(ParticlePath& path, Real born, const Vec3& extra) {
  SweepOutcome outcome;
  contact_count_ = 0;
  collect_near(path.start, path.end, path.radius);
  if (near_.empty()) return outcome;
  if (!eject(path, born, outcome)) {
    outcome.trapped = true;
    return outcome;
  }
  Real from = born;
  for (int hits = 0;; ++hits) {
    const Hit hit = first_hit(path, from);
    if (!hit.obstacle) return outcome;
    outcome.hit = true;
    respond(path, hit, from, extra, outcome);
    from = hit.fraction;
    if (hits + 1 == kMaxHits) break;
    collect_near(path.start, path.end, path.radius);
  }
  outcome.truncated = true;
  path.end = path.start;
  return outcome;
}

void ParticleSweep::collect_near(const Vec3& a, const Vec3& b, Real radius) {
  near_.clear();
  const auto add = [&](const Obstacle& o) { near_.push_back(&o); };
  fixed_.near_path(a, b, radius + kSkin, add);
  moving_.near_path(a, b, radius + kSkin, add);
}

/// Projects a particle out of the bodies that it starts in, along the nearest face (P4); the whole path moves
/// with it.
bool ParticleSweep::eject(ParticlePath& path, Real fraction, SweepOutcome& outcome) {
  for (int round = 0; round <= kMaxEjections; ++round) {
    bool clear = true;
    for (const Obstacle* o : near_) {
      const Pose pose = o->at(fraction);
      const SurfaceDistance s = signed_distance(o->solid, pose.point_to_body(path.start));
      if (s.distance >= path.radius) continue;
      if (round == kMaxEjections) return false;
      clear = false;
      outcome.ejected |= path.radius - s.distance > kDriftDepth * path.radius;
      const Vec3 out = (path.radius + kSkin - s.distance) * pose.vector_to_world(s.normal);
      path.start += out;
      path.end += out;
    }
    if (clear) return true;
    collect_near(path.start, path.end, path.radius);
  }
  return false;
}

ParticleSweep::Hit ParticleSweep::first_hit(const ParticlePath& path, Real from) const {
  Hit first;
  for (const Obstacle* o : near_) sweep_obstacle(*o, path, from, first);
  return first;
}

/// Replaces `first` if the path meets the obstacle earlier.
void ParticleSweep::sweep_obstacle(const Obstacle& o, const ParticlePath& path, Real from, Hit& first) const {
  const int pieces = o.pieces(path.radius);
  const Vec3 way = path.end - path.start;
  Vec3 a = o.at(from).point_to_body(path.start);
  for (int k = 0; k < pieces; ++k) {
    const Real share = static_cast<Real>(k + 1) / pieces, before = static_cast<Real>(k) / pieces;
    const Vec3 b = o.at(from + share * (1 - from)).point_to_body(path.start + share * way);
    if (const auto hit = sweep_sphere(o.solid, a, b, path.radius + kSkin / 2)) {
      const Real fraction = from + (before + hit->fraction / pieces) * (1 - from);
      if (first.obstacle && fraction >= first.fraction) return;
      const Pose pose = o.at(fraction);
      const Vec3 local = a + hit->fraction * (b - a) + (path.radius + kSkin - hit->distance) * hit->normal;
      first = {&o, fraction, pose.point_to_world(local), pose.vector_to_world(hit->normal)};
      return;
    }
    a = b;
  }
}

/// Velocity after free flight: the midpoint rule, exact for constant forces.
Vec3 ParticleSweep::fly(const Vec3& v, Real mass, Real duration, const Vec3& extra) const {
  const Vec3 middle = v + duration / 2 * (forces_.acceleration(v, mass) + extra);
  return v + duration * (forces_.acceleration(middle, mass) + extra);
}

/// Puts the particle at the hit with its velocity after the impulse (P5), and integrates the rest of its
/// path.
void ParticleSweep::respond(ParticlePath& path, const Hit& hit, Real from, const Vec3& extra,
                            SweepOutcome& outcome) {
  const Obstacle& o = *hit.obstacle;
  const Real friction = std::sqrt(path.friction * o.friction);
  const Vec3 body_velocity = o.velocity_at(hit.position, hit.fraction);
  Vec3 v = fly(path.start_velocity, path.mass, (hit.fraction - from) * h_, extra);

  const Vec3 u = v - body_velocity;
  const Real approach = -u.dot(hit.normal);
  const Real pressing = -(forces_.acceleration(v, path.mass) + extra).dot(hit.normal);
  const Real gain = pressing * h_;  // approach speed that the forces would restore within one sub-step
  Real restitution = std::max(path.restitution, o.restitution);
  // A bounce lasts 2 e u / a. One that ends within the sub-step is the tail of an infinite series (E6, Zeno).
  if (2 * restitution * approach < gain) restitution = 0;
  if (approach > std::max(gain, 0.0)) ++outcome.collisions;
  if (approach > 0) v += collision_impulse(path.mass, u, hit.normal, restitution, friction) / path.mass;
  if (restitution == 0) {
    // The oldest contact gives way: it matters least where the particle is now.
    if (contact_count_ == contacts_.size()) {
      std::move(contacts_.begin() + 1, contacts_.end(), contacts_.begin());
      --contact_count_;
    }
    contacts_[contact_count_++] = {hit.normal, &o, friction};
  }
  path.start = hit.position;
  path.start_velocity = v;
  finish(path, (1 - hit.fraction) * h_, extra);
}

/// Moves over the remaining time. What the forces would press into surfaces that the particle rests on, these
/// take up again with an impulse of no restitution: over the time it is the normal force and Coulomb's
/// friction.
void ParticleSweep::finish(ParticlePath& path, Real duration, const Vec3& extra) {
  Vec3 v = fly(path.start_velocity, path.mass, duration, extra);
  const Vec3 predicted = path.start + duration * path.start_velocity;
  const auto press = [&](const Contact& c) {
    const Vec3 u = v - c.obstacle->velocity_at(predicted, 1);
    if (u.dot(c.normal) >= 0) return false;
    v += collision_impulse(path.mass, u, c.normal, 0, c.friction) / path.mass;
    return true;
  };
  for (int pass = 0; pass < kContactPasses; ++pass) {
    bool pressed = false;
    for (std::size_t i = 0; i < contact_count_; ++i) pressed |= press(contacts_[i]);
    if (!pressed || contact_count_ == 1) break;
  }
  path.end_velocity = v;
  path.end = path.start + duration / 2 * (path.start_velocity + v);
}

}  // namespace offstage::sim
