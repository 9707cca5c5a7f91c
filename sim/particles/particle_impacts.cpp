#include "sim/particles/particle_impacts.h"

#include <algorithm>
#include <atomic>

#include <oneapi/tbb/parallel_for.h>

namespace offstage::sim {
namespace {

constexpr std::size_t kImpactChunk = 512;
constexpr uint32_t kMaxImpactsOfParticle = 1000;
/// Greatest number of collisions in a sub-step that are resolved in sequence.
constexpr std::size_t kMaxImpacts = 5000;
/// A particle with this many neighbours at small gaps is in a crowd.
constexpr uint32_t kCrowd = 4;
constexpr Real kNeighbourGap = 0.1;
/// Greatest number of surfaces along which a particle slides before an impact.
constexpr int kMaxSlowHits = 3;
/// Particles touch if their gap is below this fraction of the distance of their centres.
constexpr Real kTouching = 1e-6;
/// Collisions of larger clusters are left to the solver of resting contacts.
constexpr std::size_t kMaxCluster = 16;
/// Up to this number, changed particles are searched one by one; more of them are sorted first.
constexpr std::size_t kMaxUnsorted = 128;

}  // namespace

void ParticleImpacts::resolve(std::span<CollidingParticle> particles, const ParticleSearch& search,
                              const ParticleStep& step, std::vector<ParticleStrike>& strikes) {
  particles_ = particles;
  search_ = &search;
  step_ = &step;
  strikes_ = &strikes;
  stamp_.assign(particles.size(), 0);
  struck_.assign(particles.size(), {});
  sorted_stamp_.assign(particles.size(), 0);
  changed_.clear();
  unsorted_.clear();
  changed_search_.build(particles, {}, step.h, 0);
  count_ = 0;
  queue_ = {};
  count_neighbours();
  find_first();
  if (queue_.size() > kMaxImpacts) return;
  while (!queue_.empty() && count_ < kMaxImpacts) {
    const Impact impact = queue_.top();
    queue_.pop();
    if (impact.stamp_a != stamp_[impact.a] || (impact.b != kNone && impact.stamp_b != stamp_[impact.b]))
      continue;
    ++count_;
    impact.b == kNone ? collide_with_obstacle(impact) : collide_particles(impact);
  }
}

void ParticleImpacts::count_neighbours() {
  neighbours_.assign(particles_.size(), 0);
  tbb::parallel_for(
      std::size_t{0}, (particles_.size() + kImpactChunk - 1) / kImpactChunk, [&](std::size_t c) {
        for (auto i = static_cast<uint32_t>(c * kImpactChunk);
             i < std::min(particles_.size(), (c + 1) * kImpactChunk); ++i)
          for (const uint32_t j : search_->partners(i)) {
            const Real reach = (1 + kNeighbourGap) * (particles_[i].radius + particles_[j].radius);
            if ((particles_[i].position - particles_[j].position).squaredNorm() > reach * reach) continue;
            std::atomic_ref(neighbours_[i]).fetch_add(1, std::memory_order_relaxed);
            std::atomic_ref(neighbours_[j]).fetch_add(1, std::memory_order_relaxed);
          }
      });
}

/// Whether a collision is left to the solver of resting contacts, because it is in a crowd and slow enough.
bool ParticleImpacts::is_left_to_resting_contact(uint32_t i, uint32_t j, Real speed) const {
  return std::max(neighbours_[i], neighbours_[j]) >= kCrowd &&
         speed * step_->h < particles_[i].radius + particles_[j].radius;
}

/// Finds the collisions of all particles on their initial paths.
void ParticleImpacts::find_first() {
  const std::size_t n = particles_.size();
  found_.resize((n + kImpactChunk - 1) / kImpactChunk);
  tbb::parallel_for(std::size_t{0}, found_.size(), [&](std::size_t c) {
    found_[c].clear();
    NearObstacles near(step_->fixed, step_->moving);
    const auto add = [&](const Impact& impact) { found_[c].push_back(impact); };
    for (auto i = static_cast<uint32_t>(c * kImpactChunk); i < std::min(n, (c + 1) * kImpactChunk); ++i) {
      for (const uint32_t j : search_->partners(i)) find_with(i, j, add);
      find_obstacle(i, near, add);
    }
  });
  for (const auto& found : found_)
    for (const Impact& impact : found) queue_.push(impact);
}

template <class Add>
void ParticleImpacts::find_with(uint32_t i, uint32_t j, Add&& add) const {
  const CollidingParticle &a = particles_[i], &b = particles_[j];
  if (!may_collide(a, b)) return;
  const auto met = meeting(a, b, step_->h);
  if (!met) return;
  const Real speed =
      -(a.velocity_at(met->time, step_->h) - b.velocity_at(met->time, step_->h)).dot(met->normal);
  if (!is_impact(speed, greater_acceleration(a, b), *step_) || is_left_to_resting_contact(i, j, speed))
    return;
  add(Impact{met->time, i, j, stamp_[i], stamp_[j], met->normal, nullptr});
}

template <class Add>
void ParticleImpacts::find_obstacle(uint32_t i, NearObstacles& near, Add&& add) const {
  const CollidingParticle& g = particles_[i];
  const Real h = step_->h;
  if (!g.hits_bodies || g.from >= h) return;
  Vec3 end = g.at(h);
  SpherePath path(g.position, end, g.from / h);
  for (int slide = 0; slide <= kMaxSlowHits; ++slide) {
    near.find(path, g.radius);
    if (near.all().empty()) return;
    const ObstacleHit hit = near.first_hit(path, g.radius);
    if (!hit.obstacle || hit.obstacle->body == struck_[i].body) return;
    const Real time = hit.fraction * h;
    const Vec3 surface = hit.obstacle->velocity_at(hit.position, hit.fraction);
    const Real speed = -(g.velocity_at(time, h) - surface).dot(hit.normal);
    if (is_impact(speed, greater_acceleration(g, *hit.obstacle, h), *step_)) {
      if (!is_left_to_resting_contact(i, i, speed))
        add(Impact{time, i, kNone, stamp_[i], 0, hit.normal, hit.obstacle});
      return;
    }
    // The particle slides along the surface, and may hit another one.
    if (near.all().size() == 1) return;
    const PlaneAtEnd plane(hit);
    if (const Real above = plane.height(end); above < 0) end -= above * plane.normal;
    path = SpherePath(hit.position, end, hit.fraction, hit.obstacle->turn > 0 ? hit.obstacle : nullptr);
  }
}

/// Calls f for each particle that may come near the path of `particle`. The search includes particles whose
/// paths have changed.
template <class F>
void ParticleImpacts::for_each_near(const CollidingParticle& particle, F&& f) const {
  search_->for_each_near(particle, [&](uint32_t k) {
    if (stamp_[k] == 0) f(k);
  });
  changed_search_.for_each_near(particle, [&](uint32_t k) {
    if (stamp_[k] == sorted_stamp_[k]) f(k);
  });
  for (const uint32_t k : unsorted_)
    if (stamp_[k] != sorted_stamp_[k]) f(k);
}

void ParticleImpacts::collide_with_obstacle(const Impact& impact) {
  const Obstacle& o = *impact.obstacle;
  const CollidingParticle& g = particles_[impact.a];
  const Real fraction = impact.time / step_->h;
  const Vec3 contact = g.at(impact.time) - g.radius * impact.normal, arm = contact - o.centre_at(fraction);
  const Vec3 surface = o.is_dynamic() ? step_->impulses.velocity(o, arm) : o.velocity_at(contact, fraction);
  Vec3 u = g.arrival(impact.time, step_->h) - surface;
  if (g.turning > 0) u += impact.normal.cross(g.surface_spin);
  // The body may already be moving away. It then stops the particle without an impulse.
  const Vec3 impulse =
      u.dot(impact.normal) < 0
          ? collision_impulse(
                o, fraction, g.mass, u, impact.normal, std::max(g.restitution, o.restitution),
                pair_friction(g.friction, o.friction),
                o.is_dynamic() ? step_->impulses.mobility(o, arm, -impact.normal) : Mat3(Mat3::Zero()),
                g.turning)
          : Vec3(Vec3::Zero());
  if (o.is_dynamic()) {
    step_->impulses.push(reaction(o, contact, fraction, impulse));
    struck_[impact.a] = {o.body, std::max(0.0, -u.dot(impact.normal))};
  }
  particles_[impact.a].turn(impact.normal, impulse);
  strike(impact.a, impact.time, impulse / g.mass, impact.normal);
  find_again(impact.a);
}

void ParticleImpacts::collide_particles(const Impact& impact) {
  const std::vector<uint32_t> members = cluster(impact);
  if (members.size() > 2) return collide_cluster(members, impact.time);
  CollidingParticle &a = particles_[impact.a], &b = particles_[impact.b];
  const bool turn = a.turning > 0 || b.turning > 0;
  const Real m12 = a.mass * b.mass / (a.mass + b.mass);
  Vec3 u = a.arrival(impact.time, step_->h) - b.arrival(impact.time, step_->h);
  if (turn) u += rolling_velocity(a, b, impact.normal);
  const Vec3 impulse = collision_impulse(m12, turn ? mass_across(a, b) : m12, u, impact.normal,
                                         pair_restitution(a, b), pair_friction(a.friction, b.friction));
  a.turn(impact.normal, impulse);
  b.turn(impact.normal, impulse);  // both signs are opposite, so the spin has the same sign
  strike(impact.a, impact.time, impulse / a.mass, impact.normal);
  strike(impact.b, impact.time, -impulse / b.mass, -impact.normal);
  find_again(impact.a);
  find_again(impact.b);
}

/// Returns the two particles of an impact and all particles that touch them at that time, directly or through
/// other particles.
std::vector<uint32_t> ParticleImpacts::cluster(const Impact& impact) const {
  std::vector<uint32_t> members = {impact.a, impact.b};
  for (std::size_t m = 0; m < members.size(); ++m) {
    const CollidingParticle& g = particles_[members[m]];
    const Vec3 place = g.at(impact.time);
    for_each_near(g, [&](uint32_t k) {
      const CollidingParticle& other = particles_[k];
      if (other.from > impact.time || members.size() > kMaxCluster || !may_collide(g, other)) return;
      if ((place - other.at(impact.time)).norm() > (g.radius + other.radius) * (1 + kTouching)) return;
      if (std::find(members.begin(), members.end(), k) == members.end()) members.push_back(k);
    });
    if (members.size() > kMaxCluster) return {impact.a, impact.b};
  }
  return members;
}

void ParticleImpacts::collide_cluster(std::span<const uint32_t> members, Real time) {
  std::vector<ContactBody> bodies;
  std::vector<Contact> contacts;
  std::vector<Real> restitution;
  for (const uint32_t m : members)
    bodies.push_back({.inverse_mass = 1 / particles_[m].mass,
                      .inverse_inertia = particles_[m].inverse_inertia() * Mat3::Identity(),
                      .velocity = particles_[m].arrival(time, step_->h),
                      .angular_velocity = particles_[m].angular_velocity()});
  for (uint32_t i = 0; i < members.size(); ++i)
    for (uint32_t j = i + 1; j < members.size(); ++j) {
      const CollidingParticle &a = particles_[members[i]], &b = particles_[members[j]];
      const Vec3 d = a.at(time) - b.at(time);
      const Real distance = d.norm();
      if (!may_collide(a, b) || !(distance > 0) || distance > (a.radius + b.radius) * (1 + kTouching))
        continue;
      const Real friction = pair_friction(a.friction, b.friction);
      contacts.push_back({.a = i,
                          .b = j,
                          .frame = contact_frame(d / distance),
                          .arm_a = a.turning > 0 ? Vec3(-a.radius / distance * d) : Vec3::Zero(),
                          .arm_b = b.turning > 0 ? Vec3(b.radius / distance * d) : Vec3::Zero(),
                          .friction_t = friction,
                          .friction_k = friction});
      restitution.push_back(pair_restitution(a, b));
    }
  collide(bodies, contacts, restitution, step_->law);
  std::vector<Vec3> normal(members.size(), Vec3::Zero());
  for (const Contact& c : contacts) {
    if (c.impulse == Vec3::Zero()) continue;
    if (normal[c.a] == Vec3::Zero()) normal[c.a] = c.frame.n;
    if (normal[c.b] == Vec3::Zero()) normal[c.b] = -c.frame.n;
  }
  for (std::size_t m = 0; m < members.size(); ++m) {
    const Vec3 change = bodies[m].velocity - particles_[members[m]].arrival(time, step_->h);
    if (CollidingParticle& g = particles_[members[m]]; g.turning > 0)
      g.surface_spin = g.radius * bodies[m].angular_velocity;
    strike(members[m], time, change, normal[m]);
  }
  for (const uint32_t m : members) find_again(m);
}

void ParticleImpacts::strike(uint32_t i, Real time, const Vec3& change, const Vec3& normal) {
  CollidingParticle& g = particles_[i];
  g.strike(time, step_->h, change);
  if (stamp_[i]++ == 0) changed_.push_back(i);
  unsorted_.push_back(i);
  if (normal != Vec3::Zero())
    strikes_->push_back({i, time, g.position, g.velocity_at(time, step_->h), normal});
}

/// Finds the next collisions of a particle that has collided.
void ParticleImpacts::find_again(uint32_t i) {
  if (unsorted_.size() > kMaxUnsorted) {
    changed_search_.build(particles_, changed_, step_->h, 0);
    for (const uint32_t k : changed_) sorted_stamp_[k] = stamp_[k];
    unsorted_.clear();
  }
  if (stamp_[i] >= kMaxImpactsOfParticle) return;
  const auto add = [&](const Impact& impact) { queue_.push(impact); };
  for_each_near(particles_[i], [&](uint32_t k) {
    if (k != i && stamp_[k] < kMaxImpactsOfParticle) find_with(i, k, add);
  });
  NearObstacles near(step_->fixed, step_->moving);
  find_obstacle(i, near, add);
}

}  // namespace offstage::sim
