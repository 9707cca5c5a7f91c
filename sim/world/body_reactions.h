#pragma once
/// The effect of particles and cloths on bodies (physics P8, A3).

#include <map>
#include <span>

#include "sim/world/active_bodies.h"
#include "sim/world/joint_groups.h"

namespace offstage::sim {

class BodyReactions {
 public:
  BodyReactions(const WorldState& world, ActiveBodies& active, const JointGroups& joints)
      : world_(world), active_(active), joints_(joints) {}

  /// Adds the impulses of a sub-step that ends at `time` [s] to the momenta of the bodies. Joints transmit
  /// them to whole articulations. The positions change from the next sub-step on.
  void apply(std::span<const Reaction> reactions, Real time, StepReport& report);
  void forget(const Body& body) { pending_.erase(body.handle.index); }

 private:
  const WorldState& world_;
  ActiveBodies& active_;
  const JointGroups& joints_;
  std::map<uint32_t, Reaction>
      pending_;  // by slot of a sleeping body: sum of the impulses so far, too weak to wake it
};

}  // namespace offstage::sim
