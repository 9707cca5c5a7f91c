#pragma once
/// The intact joints in groups that are connected by bodies: the articulations (physics A1, A2).

#include <span>
#include <utility>
#include <vector>

#include "sim/dynamics/body_impulses.h"
#include "sim/world/active_bodies.h"

namespace offstage::sim {

class JointGroups {
 public:
  explicit JointGroups(WorldState& world) : world_(world) {}

  /// Marks the groups as outdated. Call it after a joint or one of its bodies has been added, removed or
  /// broken, or has appeared.
  void note_change() { is_current_ = false; }
  /// Rebuilds the articulations if there were changes since the last call. Returns whether there were any.
  bool update();

  /// For each articulation, the slots of its bodies that can move and collide. Bodies with a common joint are
  /// adjacent in the list.
  const std::vector<std::vector<uint32_t>>& colliding() const { return colliding_; }
  /// Whether a joint disables collisions between two bodies.
  bool is_collision_disabled(const Body& a, const Body& b) const;
  /// Returns the articulation of the body in a slot; null for a body without joints.
  Articulation* articulation_of(uint32_t slot) const;
  /// The places of bodies in their articulations, by the slots of the bodies.
  std::span<const BodyImpulses::Link> links() const { return links_; }
  /// The place of one body; without joints, its `bodies` is null.
  BodyImpulses::Link link(uint32_t slot) const {
    return slot < links_.size() ? links_[slot] : BodyImpulses::Link{};
  }

  /// Breaks the joints whose load in a sub-step of length h [s] exceeded their limits, and reports them.
  void break_overloaded(Real h, StepReport& report);
  /// Removes the joints of a body that is removed.
  void detach(const Body& body, ActiveBodies& active);

 private:
  WorldState& world_;
  bool is_current_ = true;
  std::vector<std::vector<uint32_t>> colliding_;
  std::vector<std::pair<uint32_t, uint32_t>> apart_;  // slots of bodies that do not collide, sorted
  std::vector<BodyImpulses::Link> links_;             // by slot
  std::vector<Articulation*> articulation_of_;        // by slot
};

/// Initializes a joint for the current poses of its bodies, with the anchors of the definition.
void fit(Joint& joint);
/// Initializes a joint that appears after time 0, for the current poses of its bodies. Its anchors and axes
/// have moved with body a or, without a body a, with body b.
void place_at_bodies(Joint& joint);
/// Whether a joint prevents an island from falling asleep.
bool is_driven(const Island& island, Real time);

}  // namespace offstage::sim
