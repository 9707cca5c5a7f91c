#pragma once
/// The pairs of bodies that are near each other in a sub-step, and their contact points (physics E6).

#include <span>
#include <vector>

#include "sim/collision/grouped_broad_phase.h"
#include "sim/world/active_bodies.h"
#include "sim/world/cloth_near_bodies.h"
#include "sim/world/contact_materials.h"
#include "sim/world/free_motion.h"
#include "sim/world/joint_groups.h"

namespace offstage::sim {

class ContactFinder {
 public:
  ContactFinder(const WorldState& world, const ContactMaterials& materials, ActiveBodies& active,
                const JointGroups& joints)
      : world_(world), materials_(materials), active_(active), joints_(joints), cloth_(world) {}

  void use(const CollisionMethods& methods);
  /// Adds a body to collision detection, or removes it.
  void add(const Body& body);
  void remove(const Body& body);
  /// Removes the pairs of one body, or of all bodies.
  void forget(const Body& body);
  void forget_all();
  /// Passes the groups of joints to the broad phase. Call it after they have changed.
  void update_joint_groups();

  /// Finds the pairs of a sub-step of length h and their contact points, after the bodies have moved freely.
  void find(Real h);
  /// Clears the list of pairs, for a sub-step in which no body moves.
  void clear();
  /// The pairs with a body that can move, ordered by the ranks of their bodies.
  std::span<ContactPair* const> pairs() const { return pairs_; }
  /// Calls f(pair) for all pairs, in the order of the bodies' slots.
  template <class F>
  void for_each(F&& f) const {
    graph_.for_each(f);
  }

  /// Wakes the sleeping bodies near moving bodies, moves the woken bodies through the sub-step, and returns
  /// them.
  std::vector<Body*> wake_touched(FreeMotion& motion, Real start, Real h);
  /// Adds the pairs that result from changed paths of these bodies in the sub-step. Existing pairs are kept,
  /// because impacts and islands refer to them. Returns whether pairs may have been added; see
  /// ContactPair::is_new().
  bool follow(std::span<Body* const> bodies);
  /// Adds the pairs of bodies that have been woken.
  void extend() { collect(true); }
  /// Finds the points where a pair's bodies touch at their interval's start, or may touch in the rest of the
  /// sub-step.
  void find_points(ContactPair& pair, Real time, Real h) const;
  /// Removes contacts at internal edges (internal_edges.h). The contact points of all these pairs must have
  /// been found for the same time.
  void remove_internal_edge_contacts(std::span<ContactPair* const> pairs, Real time, Real h) const;

  /// Whether each collision of this sub-step is resolved at its own time. This holds for the exact solvers,
  /// and for SolverKind::automatic while few bodies move.
  bool is_exact() const { return is_exact_; }
  /// Sets ContactPair::toi_exhausted for all pairs whose points are found in the rest of the sub-step.
  void stop_tracing() { traces_impacts_ = false; }

  /// Adds the statistics of the sub-step to the report.
  void count(StepReport& report) const;

 private:
  void propagate_impact_speeds(Real h);
  Real motion_bound(const ContactPair& pair, Real left) const;
  Real motion_known(const ContactPair& pair) const;
  void choose_event(ContactPair& pair, bool far, Real left) const;
  void move(Body& body, Aabb swept_box, bool again);
  bool move(Body& body, bool again);
  void collect(bool again);
  Aabb swept_bounds(const Body& body) const;

  const WorldState& world_;
  const ContactMaterials& materials_;
  ActiveBodies& active_;
  const JointGroups& joints_;
  ClothNearBodies cloth_;
  GroupedBroadPhase broad_phase_;  // the colliding bodies, by slot; articulations are groups
  ContactGraph graph_;
  std::vector<ContactPair*> pairs_;
  bool is_current_ = false, is_exact_ = false, traces_impacts_ = true;
  uint64_t version_ = 0;  // ActiveBodies::version() for which the pairs were found
};

}  // namespace offstage::sim
