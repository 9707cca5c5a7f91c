#pragma once
/// Impacts among the pairs of an island at one instant (physics R6, R7, N10).

#include "sim/contact/collision.h"
#include "sim/contact/contact_graph.h"

namespace offstage::sim {

struct CollisionSettings {
  Real time;             ///< time of the world at which the island collides [s]
  Real substep;          ///< length of the sub-step [s]
  Real reach;            ///< contacts with a smaller separation take part in the collision [m]
  Real collision_speed;  ///< contacts that approach faster bounce [m/s]
  ImpactLaw law;
  bool whole;  ///< true: all contacts of the island; false: only those around the contacts that bounce
  /// Contacts that will close within this time at their current speed also take part [s].
  Real ahead = 0;
};

struct CollisionOutcome {
  uint32_t bounces = 0;  ///< contacts that approached faster than CollisionSettings::collision_speed
  ContactWork work;
  Real cost = 0;                       ///< estimated from the number of operations [ns]
  const ContactPair* rough = nullptr;  ///< after a fall-back: the pair with the greatest error
};

/// Resolves the collisions of an island's pairs. It reads poses and velocities from Body::start, and changes
/// these velocities. If nothing bounces, and contacts with unmoved bodies close while another one carries a
/// body, it changes nothing, since this is resting contact. `budget` [ns] limits the cost of accurate
/// solutions of clusters of up to 100 contacts, and is reduced by this cost.
CollisionOutcome resolve_collisions(const Island& island, const CollisionSettings& settings, Real& budget);

}  // namespace offstage::sim
