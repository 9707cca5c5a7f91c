#pragma once
/// Impacts among the pairs of an island, at an instant (physics R6, R7, N10).

#include "sim/contact/collision.h"
#include "sim/contact/contact_graph.h"

namespace offstage::sim {

struct CollisionSettings {
  Real time;             ///< the world's [s]
  Real reach;            ///< what is nearer than this belongs to the cluster [m]
  Real collision_speed;  ///< what approaches faster bounces [m/s]
  ImpactLaw law;
  bool whole;  ///< all contacts of the island together, however many; else those around what bounces
};

struct CollisionOutcome {
  uint32_t bounces = 0;  ///< contacts that approached faster than CollisionSettings::collision_speed
  ContactWork work;
  Real cost = 0;                       ///< by the number of its operations [ns]
  const ContactPair* rough = nullptr;  ///< after a fall-back: the pair with the greatest error
};

/// Resolves the collisions among an island's pairs at its bodies' `start`: changes the velocities there.
CollisionOutcome resolve_collisions(const Island& island, const CollisionSettings& settings);

}  // namespace offstage::sim
