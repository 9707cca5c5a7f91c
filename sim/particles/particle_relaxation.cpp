/// Solves the contacts of ParticleContacts and moves the particles.

#include <algorithm>
#include <array>

#include <oneapi/tbb/parallel_for.h>

#include "sim/particles/particle_contacts.h"

namespace offstage::sim {
namespace {

/// The Gauss-Seidel sweeps end when a sweep changes no velocity by more than kTolerance [m/s], or when the
/// limit of work is reached. Few contacts are solved exactly; many contacts converge over several sub-steps.
constexpr Real kTolerance = 1e-7;
constexpr std::size_t kMaxContactVisits = 1'000'000;
constexpr std::size_t kMinSweeps = 30, kMaxSweeps = 1000;
/// An overlap of particles below kSlop times their radii remains. In each sub-step, the fraction kPush of a
/// larger excess is removed by moving the particles, without changing velocities.
constexpr Real kSlop = 0.002, kPush = 0.2;
constexpr int kMaxSlides = 4;
/// Number of parts of a slab that are processed in turns, so that consecutive contacts do not wait for each
/// other's velocities.
constexpr uint32_t kStreams = 4;
constexpr std::size_t kRelaxationChunk = ParticleSearch::kChunk;

Lanes lanes_of(const Eigen::Vector3f& v) {
  return Lanes{v[0], v[1], v[2], 0};
}
/// Returns the fourth lane in all lanes.
Lanes fourth(Lanes v) {
  return __builtin_shufflevector(v, v, 3, 3, 3, 3);
}
/// Returns (x, y, z, 0).
Lanes without_fourth(Lanes v) {
  return __builtin_shufflevector(v, Lanes{}, 0, 1, 2, 4);
}

/// Returns a tangential impulse, shortened to the limit of friction.
template <class Contact>
[[gnu::always_inline]] inline Lanes held_lanes(const Contact& c, Lanes along, Real limit) {
  if constexpr (requires { c.friction_axis; }) {
    if (!c.friction_axis.isZero()) return lanes(c.held(vector_of(along), limit));
  }
  const Real size2 = lane_dot(along, along);
  return size2 > limit * limit ? limit / std::sqrt(size2) * along : along;
}

/// Returns the change of a contact's impulse that changes its relative velocity from u to the target. The
/// total impulse stays within Coulomb's cone.
template <class Contact>
[[gnu::always_inline]] inline Lanes correct(Contact& c, Lanes normal, Lanes u) {
  const Lanes before = lanes_of(c.impulse_single);
  Lanes wanted = before - static_cast<Real>(c.mass) * (u - static_cast<Real>(c.target) * normal);
  const Real pressing = lane_dot(wanted, normal);
  if (pressing > 0) {
    if (c.sliding_mass != c.mass) {
      const Lanes held = before - static_cast<Real>(c.sliding_mass) * u;
      wanted = held + (pressing - lane_dot(held, normal)) * normal;
    }
    const Lanes along = held_lanes(c, wanted - pressing * normal, c.friction * pressing);
    c.impulse_single = vector_of(pressing * normal + along).template cast<float>();
  } else {
    c.impulse_single.setZero();
  }
  return lanes_of(c.impulse_single) - before;
}

}  // namespace

/// Calls on_pair for every pair and on_surface for every contact with a body, in an order that does not
/// depend on threads. Contacts that share a particle are never processed at the same time.
template <class OnPair, class OnSurface>
void ParticleContacts::for_each_contact(OnPair&& on_pair, OnSurface&& on_surface) {
  const std::size_t slabs = (order_.layer_begin.size() - 1) / 2;
  for (std::size_t color = 0; color < 2; ++color)
    tbb::parallel_for(std::size_t{0}, slabs / 2, [&](std::size_t k) {
      const std::size_t slab = 2 * k + color;
      const uint32_t begin = order_.layer_begin[2 * slab], end = order_.layer_begin[2 * slab + 2];
      std::array<uint32_t, kStreams + 1> next;
      for (uint32_t s = 0; s <= kStreams; ++s) next[s] = pair_begin_[begin + (end - begin) * s / kStreams];
      const std::array<uint32_t, kStreams + 1> first = next;
      for (bool more = true; more;) {
        more = false;
        for (uint32_t s = 0; s < kStreams; ++s) {
          if (next[s] == first[s + 1]) continue;
          Pair& c = pairs_[next[s]++];
          if (!c.is_far) on_pair(c, slab);
          more = true;
        }
      }
      for (uint32_t c = surface_begin_[begin]; c < surface_begin_[end]; ++c)
        if (surfaces_[c].pushed == kNone) on_surface(surfaces_[c], slab);
    });
  // Contacts of all particles with a body share its velocity.
  for (const uint32_t c : on_pushed_) on_surface(surfaces_[c], 0);
  for (const uint32_t c : far_) on_pair(pairs_[c], 0);
}

void ParticleContacts::start_motion() {
  motion_.resize(particles_.size());
  turns_.clear();
  if (std::ranges::any_of(particles_, [](const CollidingParticle& g) { return g.turning > 0; }))
    for (const CollidingParticle& g : particles_) {
      const Vec3& s = g.surface_spin;
      turns_.push_back({Lanes{s[0], s[1], s[2], g.turning / g.mass}});
    }
  tbb::parallel_for(std::size_t{0}, chunk_count(), [&](std::size_t c) {
    for (std::size_t i = c * kRelaxationChunk; i < std::min(particles_.size(), (c + 1) * kRelaxationChunk);
         ++i) {
      const Vec3& v = particles_[i].velocity;
      motion_[i].velocity = Lanes{v[0], v[1], v[2], 1 / particles_[i].mass};
    }
  });
}

[[gnu::always_inline]] inline Lanes ParticleContacts::relative_velocity(const Pair& c, Lanes normal) const {
  const Lanes u = without_fourth(motion_[c.a].velocity - motion_[c.b].velocity);
  if (turns_.empty()) return u;
  return u + lane_cross(normal, turns_[c.a].surface_spin + turns_[c.b].surface_spin);
}

[[gnu::always_inline]] inline Lanes ParticleContacts::relative_velocity(const Surface& c,
                                                                        Lanes normal) const {
  Lanes u = without_fourth(motion_[c.particle].velocity - lanes(c.velocity));
  if (c.pushed != kNone) u -= lanes(PushedBody::at(pushed_[c.pushed].gained, c.arm));
  return turns_.empty() ? u : u + lane_cross(normal, turns_[c.particle].surface_spin);
}

// The fourth lanes of normals and impulses are 0, so the mass, which is in the fourth lane of a particle,
// does not change.
[[gnu::always_inline]] inline void ParticleContacts::apply(const Pair& c, Lanes normal, Lanes impulse) {
  Lanes &a = motion_[c.a].velocity, &b = motion_[c.b].velocity;
  a += fourth(a) * impulse;
  b -= fourth(b) * impulse;
  if (turns_.empty()) return;
  // The arms of both particles are opposite, and so are the impulses on them. Both therefore turn in the same
  // sense.
  const Lanes turn = lane_cross(normal, impulse);
  Lanes &spin_a = turns_[c.a].surface_spin, &spin_b = turns_[c.b].surface_spin;
  spin_a -= fourth(spin_a) * turn;
  spin_b -= fourth(spin_b) * turn;
}

[[gnu::always_inline]] inline void ParticleContacts::apply(const Surface& c, Lanes normal, Lanes impulse) {
  Lanes& v = motion_[c.particle].velocity;
  v += fourth(v) * impulse;
  if (c.pushed != kNone) pushed_[c.pushed].push(-vector_of(impulse), c.arm);
  if (turns_.empty()) return;
  Lanes& spin = turns_[c.particle].surface_spin;
  spin -= fourth(spin) * lane_cross(normal, impulse);
}

void ParticleContacts::relax() {
  start_motion();
  const auto begin = [&](const auto& c, std::size_t) {
    apply(c, lanes_of(c.normal_single), lanes_of(c.impulse_single));
  };
  for_each_contact(begin, begin);
  const std::size_t slabs = (order_.layer_begin.size() - 1) / 2;
  const std::size_t most =
      std::clamp(kMaxContactVisits / std::max(contacts(), std::size_t{1}), kMinSweeps, kMaxSweeps);
  Real change2 = 1;
  for (sweeps_ = 0; sweeps_ < most && change2 > kTolerance * kTolerance; ++sweeps_) {
    slab_change2_.assign(slabs, 0);
    const auto relax_one = [&](auto& c, std::size_t slab) {
      const Lanes normal = lanes_of(c.normal_single);
      const Lanes more = correct(c, normal, relative_velocity(c, normal));
      apply(c, normal, more);
      const Real size2 = lane_dot(more, more), mass = c.mass, mass2 = mass * mass;
      if (size2 > slab_change2_[slab] * mass2) slab_change2_[slab] = size2 / mass2;
    };
    for_each_contact(
        [&](Pair& c, std::size_t slab) {
          if (!is_solved(c.a)) relax_one(c, slab);
        },
        [&](Surface& c, std::size_t slab) {
          if (!is_solved(c.particle)) relax_one(c, slab);
        });
    change2 = *std::max_element(slab_change2_.begin(), slab_change2_.end());
  }
}

/// Moves the particles by their impulses. Each impulse acts from the start of its contact.
void ParticleContacts::displace(std::span<Vec3> end, std::span<uint8_t> touched) {
  const Real h = step_->h;
  const auto press = [&](const Contact& c, uint32_t i, Real sign) {
    if (!touched[i]) end[i] = particles_[i].at(h);
    touched[i] = 1;
    end[i] += sign * (h - c.time) / particles_[i].mass * c.impulse();
  };
  for_each_contact(
      [&](const Pair& c, std::size_t) {
        if (!c.acts()) return;
        press(c, c.a, 1);
        press(c, c.b, -1);
      },
      [&](const Surface& c, std::size_t) {
        if (c.acts()) press(c, c.particle, 1);
      });
  tbb::parallel_for(std::size_t{0}, chunk_count(), [&](std::size_t c) {
    for (std::size_t i = c * kRelaxationChunk; i < std::min(particles_.size(), (c + 1) * kRelaxationChunk);
         ++i) {
      particles_[i].velocity = motion_[i].at();
      if (!turns_.empty()) particles_[i].surface_spin = turns_[i].at();
    }
  });
}

/// Returns the body of an obstacle if particles touch it; null otherwise.
const ParticleContacts::PushedBody* ParticleContacts::pushed_body(const Obstacle& o) const {
  if (!o.is_dynamic()) return nullptr;
  const auto found = pushed_index_.find(o.body);
  return found == pushed_index_.end() ? nullptr : &pushed_[found->second];
}

/// Moves the bodies by the impulses of resting contacts beyond the expected ones.
void ParticleContacts::displace_bodies() {
  for (PushedBody& body : pushed_) body.kick.setZero();
  for (const uint32_t k : on_pushed_) {
    const Surface& s = surfaces_[k];
    if (!s.is_impact || !s.acts()) continue;
    pushed_[s.pushed].kick += pushed_[s.pushed].mobility * stacked(-s.impulse(), -s.arm.cross(s.impulse()));
  }
  const std::span<const Obstacle> moving = step_->moving.all();
  for (const PushedBody& body : pushed_) {
    const Obstacle& o = *body.obstacle;
    if (moving.empty() || &o < &moving.front() || &o > &moving.back()) continue;  // asleep
    const Vec6 move = step_->h * (body.gained - body.kick);
    step_->moving.move_end(o, displaced(o.end, o.centre, move.head<3>(), move.tail<3>()), step_->h);
  }
}

/// Removes a part of the overlaps.
void ParticleContacts::push_apart(std::span<Vec3> end) {
  for_each_contact(
      [&](const Pair& c, std::size_t) {
        const Vec3 d = end[c.a] - end[c.b];
        const Real reach = particles_[c.a].radius + particles_[c.b].radius, distance = d.norm();
        const Real excess = reach * (1 - kSlop) - distance;
        if (excess <= 0 || !(distance > 0)) return;
        const Vec3 push = kPush * excess / distance * c.mass * d;
        end[c.a] += push / particles_[c.a].mass;
        end[c.b] -= push / particles_[c.b].mass;
      },
      [](const Surface&, std::size_t) {});
}

/// Moves particles that would end the sub-step inside a body or beyond it.
void ParticleContacts::keep_outside(std::span<Vec3> end, std::vector<Reaction>& reactions,
                                    std::vector<ParticleStrike>& strikes) {
  const auto for_each = [&](auto&& f) {
    tbb::parallel_for(std::size_t{0}, chunk_count(), [&](std::size_t c) {
      NearObstacles near(step_->fixed, step_->moving);
      for (auto i = static_cast<uint32_t>(c * kRelaxationChunk);
           i < std::min(particles_.size(), (c + 1) * kRelaxationChunk); ++i)
        f(i, near, found_[c]);
    });
  };
  for_each([&](uint32_t i, NearObstacles& near, Found& found) {
    if (particles_[i].hits_bodies) keep_outside(i, near, end[i], found);
  });
  for_each([&](uint32_t i, NearObstacles&, Found& found) { report(i, found); });
  for (const Found& found : found_) {
    reactions.insert(reactions.end(), found.reactions.begin(), found.reactions.end());
    strikes.insert(strikes.end(), found.strikes.begin(), found.strikes.end());
  }
}

void ParticleContacts::keep_outside(uint32_t i, NearObstacles& near, Vec3& end, Found& found) {
  CollidingParticle& g = particles_[i];
  const Real h = step_->h;
  near.find(g.position, end, g.radius);
  if (near.all().empty()) return;
  SpherePath path(g.position, end, g.from / h);
  for (int slide = 0;; ++slide) {
    const ObstacleHit hit = near.first_hit(path, g.radius);
    if (!hit.obstacle) return;
    const Vec3& from = hit.position;
    const Real fraction = hit.fraction;
    const Obstacle& o = *hit.obstacle;
    const Vec3 surface = o.velocity_at(from, fraction);
    const PlaneAtEnd plane(hit);
    if (slide == kMaxSlides) {
      end = plane.origin;
      return;
    }
    const PushedBody* pushed = pushed_body(o);
    const bool is_kicked = pushed && !pushed->kick.isZero(0);
    if (const Real above = plane.height(end); above < 0) {
      end -= above * plane.normal;
      // A body that an impact kicks moves with its new velocity from the next sub-step on. Until then it only
      // stops the particle.
      if (!is_kicked) g.velocity = velocity_after_shift(g.velocity, g.acceleration, -above * plane.normal);
    }
    path = SpherePath(from, end, fraction, o.turn > 0 ? &o : nullptr);
    const Vec3 kick = is_kicked
                          ? PushedBody::at(pushed->kick, from - g.radius * hit.normal - o.centre_at(fraction))
                          : Vec3::Zero();
    const Real approach = (surface + kick - g.velocity).dot(hit.normal);
    if (approach <= 0 || o.body == impacts_->struck_body(i)) continue;
    g.velocity += approach * hit.normal;
    if (o.is_dynamic())
      found.reactions.push_back(
          reaction(o, from - g.radius * hit.normal, fraction, g.mass * approach * hit.normal));
  }
}

/// Records the collisions at the contacts of a particle. A collision of two particles is recorded for both.
void ParticleContacts::report(uint32_t i, Found& found) const {
  const auto strike = [&](const auto& c, uint32_t particle, const Vec3& normal) {
    if (c.is_impact && c.acts())
      found.strikes.push_back(
          {particle, c.time, particles_[particle].at(c.time), particles_[particle].velocity, normal});
  };
  for (uint32_t k = pair_begin_[i]; k < pair_begin_[i + 1]; ++k) {
    strike(pairs_[k], pairs_[k].a, pairs_[k].normal());
    strike(pairs_[k], pairs_[k].b, -pairs_[k].normal());
  }
  for (uint32_t k = surface_begin_[i]; k < surface_begin_[i + 1]; ++k) {
    const Surface& s = surfaces_[k];
    strike(s, i, s.normal());
    if (!s.obstacle->is_dynamic() || !s.acts()) continue;
    // The impulse acts where the contact begins; the particle may be far away afterwards.
    const Vec3 contact = particles_[i].at(s.time) - particles_[i].radius * s.normal();
    found.reactions.push_back(reaction(*s.obstacle, contact, s.time / step_->h, s.impulse()));
    found.reactions.back().is_load = !s.is_impact;
  }
}

}  // namespace offstage::sim
