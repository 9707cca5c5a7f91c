#pragma once
/// Motion of cloths through a sub-step (physics F6-F8). Cloths move after bodies and before particles, and
/// collide with the bodies along the paths of the sub-step. Impulses of cloths change the velocities of
/// bodies from the next sub-step on; the expected ones act as forces while the bodies move.

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "sim/cloth/cloth_system.h"
#include "sim/contact/contact_pair.h"
#include "sim/world/active_bodies.h"
#include "sim/world/body_reactions.h"

namespace offstage::sim {

class ClothMotion {
 public:
  ClothMotion(const WorldState& world, ActiveBodies& active) : world_(world), active_(active) {}

  /// Updates the list of cloths to step. Call it after a cloth has been added or removed, or has appeared.
  void arrange();
  /// Lets the pins of all cloths that exist hold their vertices at the present places relative to a body.
  /// Call it when the body appears.
  void place_pins(const Body& body);
  /// The same for all pins of a cloth to bodies that exist. Call it when the cloth appears.
  void place_pins(Cloth& cloth);
  /// Releases all cloth vertices that are pinned to a body.
  void detach(BodyHandle body);

  /// Smallest thickness of the cloths that collide with bodies and move [m]; infinite if there are none.
  Real thinnest() const { return system_.thinnest(); }
  /// Returns for each of these cloths the box of all positions that it may reach within the time h [s].
  std::vector<Aabb> reaches(Real h) const { return system_.reaches(h); }
  /// Returns the time within h [s] at which a box that moves at `velocity` may meet cloth.
  std::optional<Real> first_meeting(const Aabb& box, const Vec3& velocity, Real h) const {
    return system_.first_meeting(box, velocity, h);
  }

  void begin_step();
  /// Adds the expected loads of bodies in the sub-step of length h [s] that begins at `time` [s], as constant
  /// forces, and the leads of their velocities (ClothBody::lead()) as impulses. A body that cloth pressed
  /// against others in the last sub-step gets the force that this needs.
  void begin_substep(Real time, Real h, BodyReactions& reactions, StepReport& report);
  /// Moves all cloths through a sub-step, displaces bodies where cloths push them, and applies the impulses
  /// on the bodies. `pairs`: the pairs of bodies of this sub-step, which may press cloth.
  void step(Real start, Real h, std::span<ContactPair* const> pairs, BodyReactions& reactions,
            StepReport& report);
  /// Adds the statistics of the step to the report.
  void report(StepReport& report);

 private:
  /// Two bodies with cloth between them.
  struct PressedCloth {
    BodyHandle a, b;
    Real force;  // along the normal in the last sub-step in which one of them was awake [N]
    bool has_friction_a, has_friction_b;
    std::vector<PairLayer::Place> places;
  };

  std::vector<uint8_t> loaded_bodies() const;
  std::vector<ClothBody> bodies_near_cloths(Real h) const;
  void find_pressed(std::span<ContactPair* const> pairs);
  bool is_between(const PressedCloth& pressed) const;
  void wake_unpinned(std::span<const ClothBody> near);
  void set_joints(std::span<ClothBody> near, Real h, const BodyReactions& reactions) const;
  void name_first_tears(Real start);
  void record_loads(std::span<const ClothBody> near, Real h);
  std::vector<Reaction> answer(std::span<const ClothBody> near, Real h, BodyReactions& reactions);
  void push_supports(const ClothBody& at, std::vector<Reaction>& reactions);

  const WorldState& world_;
  ActiveBodies& active_;
  ClothSystem system_;
  std::vector<PressedCloth> pressed_;
  struct Push {
    BodyHandle body;
    Wrench impulse;  // [N s], [N m s]
  };
  std::vector<Push> pushes_;  // for the next sub-step
  struct Load {
    BodyLoad force;
    Wrench lead;  // ClothBody::lead()
  };
  std::map<uint32_t, Load> loads_;  // by slot
  std::vector<uint32_t> resting_;   // slots of bodies that rested on others, sorted
};

}  // namespace offstage::sim
