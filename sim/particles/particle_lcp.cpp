/// Computes the contact forces of small clusters of particles as a linear complementarity problem, as in the
/// book (physics P7, N9, N10).

#include <algorithm>

#include "sim/contact/contact_lcp.h"
#include "sim/core/disjoint_sets.h"
#include "sim/core/parallel_loop.h"
#include "sim/particles/particle_contacts.h"

namespace offstage::sim {

/// Returns the clusters: groups of particles that touch each other, with their contacts. Clusters of more
/// than `most` contacts are counted as fall-backs and not returned. Clusters on dynamic bodies are not
/// returned either: they change the velocities of the bodies, and so depend on each other.
std::vector<ParticleContacts::Cluster> ParticleContacts::find_clusters(uint32_t most) {
  DisjointSets sets(particles_.size());
  for (const Pair& c : pairs_) sets.join(c.a, c.b);
  std::vector<uint32_t> sizes(particles_.size(), 0);
  for (const Pair& c : pairs_) ++sizes[sets.find(c.a)];
  for (const Surface& c : surfaces_) ++sizes[sets.find(c.particle)];
  std::vector<uint8_t> is_shared(particles_.size(), 0);
  for (const uint32_t k : on_pushed_) is_shared[sets.find(surfaces_[k].particle)] = 1;
  constexpr uint32_t kTooLarge = ~0u;
  std::vector<uint32_t> number(particles_.size(), kTooLarge);
  std::vector<Cluster> clusters;
  for (uint32_t i = 0; i < particles_.size(); ++i) {
    if (sizes[i] == 0 || is_shared[i]) continue;
    ++lcp_work_.solves;
    if (sizes[i] > most) {
      ++lcp_work_.fallbacks;
      continue;
    }
    number[i] = static_cast<uint32_t>(clusters.size());
    clusters.emplace_back();
  }
  for (uint32_t k = 0; k < pairs_.size(); ++k)
    if (const uint32_t n = number[sets.find(pairs_[k].a)]; n != kTooLarge) clusters[n].pairs.push_back(k);
  for (uint32_t k = 0; k < surfaces_.size(); ++k)
    if (const uint32_t n = number[sets.find(surfaces_[k].particle)]; n != kTooLarge)
      clusters[n].surfaces.push_back(k);
  return clusters;
}

/// Solves the contacts of one cluster. Returns false and changes nothing if the pivoting method fails.
bool ParticleContacts::solve_cluster(const Cluster& cluster, ContactWork& work) {
  std::vector<uint32_t> members;
  for (const uint32_t k : cluster.pairs) members.insert(members.end(), {pairs_[k].a, pairs_[k].b});
  for (const uint32_t k : cluster.surfaces) members.push_back(surfaces_[k].particle);
  std::sort(members.begin(), members.end());
  members.erase(std::unique(members.begin(), members.end()), members.end());
  std::vector<ContactBody> bodies;
  for (const uint32_t i : members) {
    bodies.emplace_back();
    bodies.back().inverse_mass = 1 / particles_[i].mass;
    bodies.back().inverse_inertia = particles_[i].inverse_inertia() * Mat3::Identity();
    bodies.back().velocity = particles_[i].velocity;
    bodies.back().angular_velocity = particles_[i].angular_velocity();
  }
  const auto row = [&](uint32_t particle) {
    return static_cast<uint32_t>(std::lower_bound(members.begin(), members.end(), particle) -
                                 members.begin());
  };
  std::vector<sim::Contact> contacts;
  const auto add = [&](const Contact& c, uint32_t a, uint32_t b) -> sim::Contact& {
    sim::Contact& contact = contacts.emplace_back();
    contact.a = a;
    contact.b = b;
    contact.frame = contact_frame(c.normal().normalized());
    const auto arm = [&](uint32_t body, Real sign) {
      const bool turns = body < members.size() && particles_[members[body]].turning > 0;
      return turns ? Vec3(sign * particles_[members[body]].radius * contact.frame.n) : Vec3::Zero();
    };
    contact.arm_a = arm(a, -1);
    contact.arm_b = arm(b, 1);
    contact.target = c.target;
    contact.friction_t = contact.friction_k = c.friction;
    return contact;
  };
  for (const uint32_t k : cluster.pairs) add(pairs_[k], row(pairs_[k].a), row(pairs_[k].b));
  for (const uint32_t k : cluster.surfaces) {
    const Surface& s = surfaces_[k];
    bodies.emplace_back();
    bodies.back().velocity = s.velocity;
    sim::Contact& contact = add(s, row(s.particle), static_cast<uint32_t>(bodies.size() - 1));
    if (s.friction_axis.isZero()) continue;
    contact.frame.t = s.friction_axis;
    contact.frame.k = contact.frame.n.cross(s.friction_axis);
    contact.friction_k = contact.friction_t * s.obstacle->cross_friction;
  }
  if (!solve_by_lcp(bodies, contacts, {}, work)) return false;
  std::size_t next = 0;
  const auto store = [&](Contact& c) {
    c.impulse_single = contacts[next].to_world(contacts[next].impulse).cast<float>();
    ++next;
  };
  for (const uint32_t k : cluster.pairs) store(pairs_[k]);
  for (const uint32_t k : cluster.surfaces) store(surfaces_[k]);
  for (const uint32_t i : members) solved_[i] = 1;
  return true;
}

void ParticleContacts::solve_clusters(uint32_t most) {
  solved_.assign(particles_.size(), 0);
  const std::vector<Cluster> clusters = find_clusters(most);
  std::vector<ContactWork> works(clusters.size());
  for_each_index(clusters.size(), [&](std::size_t i) { solve_cluster(clusters[i], works[i]); });
  for (ContactWork& work : works) {
    work.solves = 0;  // counted by find_clusters()
    lcp_work_.add(work);
  }
}

}  // namespace offstage::sim
