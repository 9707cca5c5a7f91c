#pragma once
/// Impacts within a sub-step (physics E6, E7, R12). Bodies, with all objects connected to them, are moved
/// back to the time of impact, collide there, and continue for the rest of the sub-step. Other bodies are not
/// changed. The work is bounded: if a pair collides too often in a sub-step, or if there are too many
/// impacts, later ones are left to the contact solver, which also prevents tunnelling. In a pile with too
/// many impacts the restitution of slower ones is suppressed for the rest of the sub-step. If that is not
/// enough, all contacts that would close in the rest of the sub-step bounce at once.
///
/// Joints that rebound from their limits are moved back to the times of these impacts in the same way.
///
/// The contact point of a wobbling coin moves far around its rim within a sub-step. Such a body is moved in
/// several pieces of the sub-step, and its contacts are updated between them.

#include <vector>

#include "sim/world/contact_finder.h"
#include "sim/world/contact_solver.h"

namespace offstage::sim {

/// Resolves the impacts of one sub-step, which begins at time `start` and has length h [s]. The bodies must
/// have moved to the end of the sub-step, and islands and pairs must have been found for this motion.
class ImpactStage {
 public:
  ImpactStage(const WorldState& world, const ActiveBodies& active, ContactFinder& contacts,
              ContactSolver& solver, FreeMotion& motion, std::vector<Island>& islands, Real start, Real h,
              StepReport& report)
      : world_(world),
        active_(active),
        contacts_(contacts),
        solver_(solver),
        motion_(motion),
        islands_(islands),
        start_(start),
        h_(h),
        report_(report) {}

  void resolve();

 private:
  struct Event {
    Real time;  // since the sub-step's start
    ContactPair* pair;
    bool is_impact;  // if false, the contacts of the pair are updated, because they move around a rim
    // If not null, the articulation rebounds from a limit of a joint; there is no pair.
    Articulation* rebounding = nullptr;
  };

  template <class IsWanted>
  void search(IsWanted&& is_wanted);
  template <class IsWanted>
  void search_rebounds(IsWanted&& is_wanted);
  uint32_t rebound_at(const Event& event);
  uint32_t impact_at(const Event& event);
  void end_tracing(const Event& first);
  Real cost() const;
  std::size_t most_impacts() const;
  Real greatest_cost() const;
  void add_rim_updates();
  uint32_t gather(const ContactPair& pair, Real time);
  void join_all_pending(uint32_t number, Real time);
  void end_at_once(const Event& first);
  void limit(ContactPair& pair, std::size_t count);
  void trace_back(Island& island, Real time);
  void join(uint32_t into, uint32_t island);
  void join_pending(uint32_t number, Real time);
  void suppress_restitution(uint32_t island);
  void collide(uint32_t number, Real time);
  void bounce(uint32_t number, Real time, Real ahead);
  void find_points(ContactPair& pair, Real time);
  void continue_from(uint32_t number, Real time);
  bool join_next(uint32_t number, Real time);
  bool join_overtaken(uint32_t number, Real time);
  bool closes(const ContactPair& pair, Real left) const;
  bool overlaps_at_end(const ContactPair& pair, Real time) const;
  void find_pairs_again(uint32_t number);

  const WorldState& world_;
  const ActiveBodies& active_;
  ContactFinder& contacts_;
  ContactSolver& solver_;
  FreeMotion& motion_;
  std::vector<Island>& islands_;
  Real start_, h_;
  StepReport& report_;
  std::vector<Event> pending_;
  Real cost_ = 0;         // without the solvers of resting contact [ns]
  Real cost_before_ = 0;  // of the solvers of resting contact, before the first impact [ns]
  /// Cost of accurate solutions of large clusters that is left in the sub-step [ns]; at its start 0.5 ms.
  Real accurate_left_ = 5e5;
};

}  // namespace offstage::sim
