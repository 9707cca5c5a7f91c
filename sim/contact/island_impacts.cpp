#include "sim/contact/island_impacts.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <vector>

#include "sim/contact/bounded_collision.h"
#include "sim/contact/contact_terms.h"
#include "sim/contact/island_joints.h"

namespace offstage::sim {
namespace {

/// Clusters of at most kSmallCluster contacts are always solved as a whole. Clusters of more than kCluster
/// contacts, or with more than kGrowths extensions, are solved as a whole only on request.
constexpr std::size_t kSmallCluster = 40, kCluster = 100;
constexpr int kGrowths = 2;
/// Contacts that approach more slowly than this carry their bodies [m/s].
constexpr Real kStillCloses = 1e-4;
/// Cost of an update of a contact, of a product of a dense factorization, and of a body in a factorization of
/// a system with joints, which is sparse [ns].
constexpr Real kContactUpdate = 60, kDenseProduct = 0.7, kSparseBody = 3000;

/// Returns the cost of a factorization without joints, for at most this many contacts [ns].
Real dense_cost(std::size_t contacts, bool whole) {
  const std::size_t most = whole ? kSmallCluster : kFewContacts;
  return std::pow(3.0 * static_cast<Real>(std::min(contacts, most)), 3) * kDenseProduct;
}

std::vector<std::size_t> indices_of(std::span<const uint8_t> marks) {
  std::vector<std::size_t> marked;
  for (std::size_t i = 0; i < marks.size(); ++i)
    if (marks[i]) marked.push_back(i);
  return marked;
}

std::vector<std::size_t> all_of(std::size_t count) {
  std::vector<std::size_t> all(count);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

/// Contacts of an island that collide together, with the bodies' velocities before the collision.
struct CollisionCluster {
  std::vector<ContactBody> bodies;
  std::vector<Contact> contacts;
  std::vector<Real> restitution;
  std::vector<uint8_t> bounces, touches;  // by contact
  std::vector<const ContactPair*> pairs;  // by contact

  void add(const ContactPair& pair, const CollisionSettings& settings) {
    const auto row = [&](const Body& body) {
      if (body.is_awake()) return body.row;
      bodies.push_back(unmoved_body(body));
      return static_cast<uint32_t>(bodies.size() - 1);
    };
    const uint32_t a = row(pair.a()), b = row(pair.b());
    for (const PlacedManifold& m : pair.manifolds()) {
      const Vec3 surface = surface_velocity(pair, m.frame.n);
      for (uint32_t k = 0; k < m.manifold.count; ++k) {
        const ContactPoint& point = m.manifold.points[k];
        const Vec3 place = (point.on_a + point.on_b) / 2;
        if (point.separation > settings.reach &&
            (settings.ahead == 0 ||
             point.separation + settings.ahead * pair.relative_velocity(place).dot(m.frame.n) > 0))
          continue;
        Contact c{.a = a, .b = b, .frame = m.frame};
        c.arm_a = place - origin(pair.a());
        c.arm_b = place - origin(pair.b());
        c.offset = m.frame.components(surface);
        const Vec3 u = c.relative_velocity(bodies);
        std::tie(c.friction_t, c.friction_k) = friction(pair.surface(), u);
        contacts.push_back(c);
        pairs.push_back(&pair);
        bounces.push_back(u.x() < -settings.collision_speed);
        touches.push_back(point.separation <= kTouching);
        // In a sequence, the impulse of another contact can make a resting contact collide.
        restitution.push_back(
            bounces.back() || settings.law == ImpactLaw::sequential ? pair.surface().restitution : 0);
      }
    }
  }

  /// Whether nothing that touches bounces, and contacts with unmoved bodies close while another one carries a
  /// body. The solver of resting contacts stops each of them at its own time, when others may have slowed it
  /// down. A collision would also stop those that have a gap, and a wheel would lose energy at concave seams
  /// that it has not reached.
  bool only_closes() const {
    bool carries = false;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const Contact& c = contacts[i];
      const bool approaches = c.relative_velocity(bodies).x() < -kStillCloses,
                 yields = bodies[c.a].is_moved() && bodies[c.b].is_moved();
      if ((bounces[i] && touches[i]) || (approaches && yields)) return false;
      carries = carries || !(approaches || yields);
    }
    return carries;
  }

  /// Marks the wanted contacts, and all contacts that share a movable body with one of them.
  void take(std::span<const std::size_t> wanted, std::vector<uint8_t>& taken) const {
    std::vector<uint8_t> involved(bodies.size(), 0);
    for (const std::size_t i : wanted)
      for (const uint32_t body : {contacts[i].a, contacts[i].b}) involved[body] |= bodies[body].is_moved();
    for (std::size_t i = 0; i < contacts.size(); ++i)
      if (involved[contacts[i].a] || involved[contacts[i].b]) taken[i] = 1;
  }
};

/// Returns the cost of solving some contacts of a cluster [ns].
Real cost_of(const ContactWork& work, const CollisionCluster& cluster, std::size_t contacts, bool whole,
             bool with_joints) {
  const Real factorization =
      with_joints ? kSparseBody * static_cast<Real>(cluster.bodies.size()) : dense_cost(contacts, whole);
  return kContactUpdate * static_cast<Real>(work.iterations * contacts) +
         factorization * static_cast<Real>(work.factorizations);
}

/// Collides the part of a large cluster that the impact reaches: the bouncing contacts and the contacts
/// around them. If the impulses make other contacts approach so fast that they bounce, these contacts and the
/// contacts around them are added. This is repeated until there are no more. The other contacts need no
/// impulse. After kGrowths extensions, a cluster of at most kCluster contacts is solved as a whole if there
/// is budget left. Others are truncated; afterwards the omitted contacts block as resting contacts. The cost
/// is added to `cost` [ns].
ContactWork collide_reached(CollisionCluster& cluster, const CollisionSettings& settings,
                            const JointProblem& joints, Real& budget, Real& cost) {
  std::vector<uint8_t> taken(cluster.contacts.size(), 0);
  std::vector<std::size_t> wanted = indices_of(cluster.bounces);
  if (settings.ahead > 0 && !wanted.empty()) wanted = all_of(cluster.contacts.size());
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
    const ContactWork one =
        collide_bounded(cluster.bodies, contacts, restitution, settings.law, joints, budget);
    cost += cost_of(one, cluster, contacts.size(), false, !joints.empty());
    work.add(one);
    work.solves = 1;
    work.fallbacks = one.fallbacks;
    work.residual = one.residual;
    for (std::size_t k = 0; k < together.size(); ++k) {
      cluster.contacts[together[k]].impulse = contacts[k].impulse;
      cluster.contacts[together[k]].is_guessed = true;
    }
    wanted.clear();
    for (std::size_t i = 0; i < taken.size(); ++i)
      if (!taken[i] && cluster.contacts[i].relative_velocity(cluster.bodies).x() < -settings.collision_speed)
        wanted.push_back(i);
    if (wanted.empty()) break;
    if (round == kGrowths && taken.size() <= kCluster && budget > 0) {
      wanted = all_of(taken.size());
    } else if (together.size() > kCluster || round >= kGrowths) {
      work.cluster_truncated = 1;
      break;
    }
  }
  return work;
}

}  // namespace

CollisionOutcome resolve_collisions(const Island& island, const CollisionSettings& settings, Real& budget) {
  CollisionCluster cluster;
  for (Body* body : island.bodies) {
    body->row = static_cast<uint32_t>(cluster.bodies.size());
    cluster.bodies.push_back({1 / body->rigid.mass, inverse_inertia(body->rigid, body->start.orientation),
                              body->start_twist.velocity, body->start_twist.angular_velocity});
  }
  for (const ContactPair* pair : island.pairs) cluster.add(*pair, settings);
  CollisionOutcome outcome;
  if (cluster.contacts.empty() || cluster.only_closes()) return outcome;
  IslandJoints joints;
  joints.collect_for_collision(island, settings.time, settings.substep);
  const JointProblem problem = joints.problem();
  const bool is_reached = !settings.whole && cluster.contacts.size() > kSmallCluster;
  if (settings.whole)
    outcome.work = collide(cluster.bodies, cluster.contacts, cluster.restitution, settings.law, problem);
  else if (!is_reached)
    outcome.work =
        collide_bounded(cluster.bodies, cluster.contacts, cluster.restitution, settings.law, problem, budget);
  else
    outcome.work = collide_reached(cluster, settings, problem, budget, outcome.cost);
  if (!is_reached)
    outcome.cost = cost_of(outcome.work, cluster, cluster.contacts.size(), settings.whole, !problem.empty());
  if (outcome.work.fallbacks > 0)
    if (const auto worst = worst_contact(cluster.bodies, cluster.contacts))
      outcome.rough = cluster.pairs[*worst];
  for (Body* body : island.bodies) {
    const ContactBody& b = cluster.bodies[body->row];
    body->set_start_velocity(b.velocity, b.angular_velocity);
  }
  joints.store_impact_impulses();
  outcome.bounces = static_cast<uint32_t>(std::count(cluster.bounces.begin(), cluster.bounces.end(), 1));
  return outcome;
}

}  // namespace offstage::sim
