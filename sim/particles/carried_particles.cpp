/// Particles that turning bodies carry, alone or in heaps (physics P3).

#include <algorithm>
#include <vector>

#include "sim/particles/particle_contacts.h"

namespace offstage::sim {
namespace {

/// Bodies whose turn in the sub-step bends the path of none of their points by more than this do not count as
/// turning [m].
constexpr Real kStraight = 1e-10;
/// A particle moves with a body if its velocity relative to the body is at most this fraction of the
/// velocity of the body's material there.
constexpr Real kSlip = 0.5;

bool turns(const Obstacle& o, Real h) {
  return o.angular_velocity.squaredNorm() * h * h * o.extent / 2 > kStraight;
}

}  // namespace

/// Returns for each particle the obstacle on which it rests or, in a heap, the obstacle that the fewest
/// contacts connect with it; null if there is none.
std::vector<const Obstacle*> ParticleContacts::find_carriers() const {
  const std::size_t n = particles_.size();
  std::vector<const Obstacle*> carriers(n, nullptr);
  std::vector<uint32_t> reached;
  for (const Surface& s : surfaces_)
    if (s.acts() && !s.is_impact && !carriers[s.particle]) {
      carriers[s.particle] = s.obstacle;
      reached.push_back(s.particle);
    }
  // The neighbours of each particle, in the order of the pairs.
  const auto holds = [](const Pair& c) { return c.acts() && !c.is_impact; };
  std::vector<uint32_t> begin(n + 2, 0), neighbours;
  for (const Pair& c : pairs_)
    if (holds(c)) ++begin[c.a + 2], ++begin[c.b + 2];
  for (std::size_t i = 2; i < begin.size(); ++i) begin[i] += begin[i - 1];
  neighbours.resize(begin.back());
  for (const Pair& c : pairs_)
    if (holds(c)) {
      neighbours[begin[c.a + 1]++] = c.b;
      neighbours[begin[c.b + 1]++] = c.a;
    }
  for (std::size_t k = 0; k < reached.size(); ++k) {
    const uint32_t i = reached[k];
    for (uint32_t at = begin[i]; at < begin[i + 1]; ++at)
      if (const uint32_t j = neighbours[at]; !carriers[j]) {
        carriers[j] = carriers[i];
        reached.push_back(j);
      }
  }
  return carriers;
}

/// Corrects the displacements of particles that turning bodies carry. displace() moves particles by the
/// velocities at the end of the sub-step. A point of a turning body follows an arc, and with these velocities
/// it would come nearer to the axis by (w h)^2 r / 2. The path of a carried particle is straight in the frame
/// of the body, as the path of a single particle is.
void ParticleContacts::follow_carriers(std::span<Vec3> end) const {
  const Real h = step_->h;
  if (std::ranges::none_of(surfaces_, [&](const Surface& s) { return s.acts() && turns(*s.obstacle, h); }))
    return;
  const std::vector<const Obstacle*> carriers = find_carriers();
  for (std::size_t i = 0; i < particles_.size(); ++i) {
    const CollidingParticle& g = particles_[i];
    if (!carriers[i] || g.from > 0 || !turns(*carriers[i], h)) continue;
    const Obstacle& o = *carriers[i];
    const Vec3 surface = o.velocity_at(end[i], 1);
    if ((g.velocity - surface).norm() > kSlip * surface.norm()) continue;
    const Vec3 carried = o.turned_at(1).point_to_world(o.turned_at(0).point_to_body(g.position));
    end[i] += carried - g.position - h * surface;
  }
}

}  // namespace offstage::sim
