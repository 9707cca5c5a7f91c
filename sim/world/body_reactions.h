#pragma once
/// The effect of particles and cloths on bodies (physics P8, A3).

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "sim/contact/contact_pair.h"
#include "sim/world/active_bodies.h"
#include "sim/world/body_load.h"
#include "sim/world/joint_groups.h"

namespace offstage::sim {

class BodyReactions {
 public:
  BodyReactions(const WorldState& world, ActiveBodies& active, const JointGroups& joints)
      : world_(world), active_(active), joints_(joints) {}

  /// Begins a sub-step: removes the forces of the last one, and adds the expected loads of resting particles.
  void begin_substep();
  /// Adds a force that acts on a body during the sub-step.
  void add_force(BodyHandle body, const Wrench& force);
  bool has_loads() const { return !loads_.empty(); }
  /// Returns the loads of bodies in a sub-step of length h [s], by slot, also of those within `particles`
  /// that have none yet. `pairs`: all pairs of bodies of this sub-step, after the contact solver.
  std::map<uint32_t, BodyImpulses::Load> loads(std::span<ContactPair* const> pairs, const Aabb& particles,
                                               Real h);
  /// Applies the impulses of particles in a sub-step of length h [s] that ends at `time` [s]. The forces of
  /// resting particles are expected in the next sub-steps, too.
  void apply_particles(const BodyImpulses& impulses, Real time, Real h, StepReport& report);

  /// Adds the impulses of a sub-step that ends at `time` [s] to the momenta of the bodies. Joints transmit
  /// them to whole articulations. The positions change from the next sub-step on.
  void apply(std::span<const Reaction> reactions, Real time, StepReport& report);
  /// Returns the responses of a body with joints, and of the bodies to which they connect it, to impulses on
  /// it roughly in the direction of `push`, by slot; see Articulation::link_responses(). It is empty for
  /// other bodies.
  std::map<uint32_t, Mat6> link_responses(uint32_t slot, const Vec6& push) const;
  /// Moves bodies with joints, and the bodies to which joints connect them. `pushes`: by slot, impulse and
  /// angular impulse about the centre of mass times the time for which they move the body [N s^2, N m s^2].
  void displace_links(const std::map<uint32_t, Vec6>& pushes);
  void forget(const Body& body);

 private:
  /// The force of resting particles on a body.
  struct Load {
    BodyLoad force;
    /// Force on the bodies beneath in the next sub-step: the part of the impulses on this body that its
    /// contacts with them have balanced.
    Wrench passed;
    std::optional<Mat6> mobility;  ///< of a body that rests on others; see RestingContacts::held_mobility()
  };
  void displace(Real h);
  Reaction balance(const Body& body, Load& load, const Reaction& sum, Real h) const;

  const WorldState& world_;
  ActiveBodies& active_;
  const JointGroups& joints_;
  std::map<uint32_t, Load> loads_;  // by slot
  std::vector<BodyHandle> pushed_;  // bodies with a force in the current sub-step
  std::map<uint32_t, Reaction>
      pending_;  // by slot of a sleeping body: sum of the impulses so far, too weak to wake it
};

}  // namespace offstage::sim
