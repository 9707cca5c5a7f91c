#pragma once
/// From bodies and their contact pairs to problems for the solvers, and back: resting contact over an
/// interval, and collisions at an instant (physics E6, R7-R10, N11, N12).

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sim/articulation/joint_limits.h"
#include "sim/contact/collision.h"
#include "sim/contact/contact_pair.h"
#include "sim/contact/proximal_newton.h"
#include "sim/contact/relaxation.h"
#include "sim/contact/relaxed_joints.h"
#include "sim/contact_graph.h"

namespace offstage::sim {

/// What all solutions of an interval share.
struct ContactInterval {
  Real duration;  ///< [s], > 0
  Real end;       ///< the world's time [s]
  Real substep;   ///< of which the interval is all or a part [s]; penetration is pushed out at its pace
  /// A sub-step as if nothing had hit anything: its forces are what the next one begins with. Else it is the
  /// part before or after an impact. What stops a body in such a moment takes a force that would throw it far
  /// if it lasted, and a part that is made anew after each of many impacts would add to its forces each time.
  bool is_whole = true;
};

/// Whether anything but free motion happens in an island.
bool has_forces(const Island& island);

/// The joints of islands as part of a problem: their bodies have the indices Body::row.
class IslandJoints {
 public:
  /// For an interval.
  void collect(std::span<const Island* const> islands, const ContactInterval& interval);
  /// For a collision at the bodies' start.
  void collect_for_collision(const Island& island, Real time);
  /// After a collision: the joints bear its blows.
  void tell_blows();
  JointProblem problem() { return {constraints_, bounded_, impulses_}; }
  /// After the solution: the joints tell of their forces, and keep them as a guess.
  void tell(Real duration);

  std::span<Articulation* const> articulations() const { return articulations_; }
  /// Where the rows with bounds of each articulation end.
  std::span<const uint32_t> bounded_ends() const { return bounded_ends_; }
  std::span<const BoundedRow> bounded() const { return bounded_; }
  std::span<const BoundedOrigin> origins() const { return origins_; }

 private:
  void collect_constraints(const Island& island, Real time, bool at_start);
  Wrench wrench(std::size_t bounded, Real impulse) const;

  std::vector<Articulation*> articulations_;
  std::vector<JointConstraint> constraints_;
  std::vector<BoundedRow> bounded_;
  std::vector<BoundedOrigin> origins_;
  std::vector<uint32_t> bounded_ends_;
  std::vector<Vec6> impulses_;
};

/// One island's contacts as a problem, solved to rounding. The bodies have moved freely through the interval
/// from their `start` to `rigid`; what the contacts add is put on top. Keep one per island.
class ExactContacts {
 public:
  struct Outcome {
    bool is_applied = false;  ///< else nothing changed: over budget, or `rough` and not safe
    ContactWork work;
    const ContactPair* rough = nullptr;  ///< after a fall-back: the pair with the greatest error
  };
  /// Gives up beyond `budget` [ns, see SolverChoice]. The result of a fall-back is applied only if its error
  /// is small and it adds no kinetic energy; else the island is one for the fast solver, which always ends.
  Outcome solve(const Island& island, const ContactInterval& interval, Real budget);
  /// What the last solve() took.
  Real cost() const { return newton_.cost(); }

 private:
  uint32_t add_body(Body& body);
  void add_points(ContactPair& pair, const ContactInterval& interval);
  bool is_safe(const ContactWork& work) const;
  void move_bodies(const Island& island, Real duration);
  void close_stops();
  void close_neighbors(const Island& island, Real duration);

  std::vector<ContactBody> bodies_, free_;  // the latter without contacts
  std::vector<Contact> contacts_;
  std::vector<const ContactPair*> pairs_;  // of the contacts
  std::vector<PointForce*> forces_;        // of the contacts, in their pairs
  std::vector<Real>
      approach_;  // of the contacts at the start, either way, beyond what turning explains [m/s]
  std::vector<uint8_t> closing_;  // by body: some contact came together in the interval
  IslandJoints joints_;
  ProximalNewton newton_;
};

/// Several islands at once by the fast solver.
class FastContacts {
 public:
  ContactWork solve(std::span<const Island* const> islands, const ContactInterval& interval);

 private:
  struct Origin {
    ContactPair* pair;
    PlacedManifold* manifold;
    uint32_t a, b;
  };
  void collect(std::span<const Island* const> islands);

  std::vector<Body*> members_;  // those that move first, then one for each contact with another
  std::size_t moved_ = 0;
  std::vector<RelaxedBody> bodies_;
  std::vector<Origin> origins_;  // of the patches
  std::vector<ContactPatch> patches_;
  IslandJoints joints_;
  RelaxationSolver solver_;
};

/// What the exact solver may take beyond the fast one, over all islands of a world: in a heap that comes down
/// there is a new island in every sub-step, each of which would be dear.
class SolverPatience {
 public:
  /// A sub-step with these islands begins.
  void begin(std::span<Island* const> islands, Real duration);
  /// An attempt on an island took so much more than it is worth [ns].
  void spend(Real cost) { debt_ += cost; }
  /// How much of the credit is left, from 0 to 1.
  Real left() const { return left_; }
  /// Whether the world is so small that no solver takes long.
  bool is_small() const { return small_; }

 private:
  Real debt_ = 0, left_ = 1;
  bool small_ = true;
};

/// Whether an island is for the exact or the fast solver, by what the exact one cost on islands like it
/// before. Costs are counted work times what the operations take on a machine of 2020 [ns], so that the
/// choice is the same in every run.
class SolverChoice {
 public:
  /// Whether to try the exact solver now.
  bool is_exact_worth(const Island& island, const SolverPatience& patience);
  /// What the attempt may cost, so that all attempts together take but a share of what the fast solver takes.
  Real budget(const Island& island, Real duration, const SolverPatience& patience) const;
  /// What became of the attempt.
  void learn(const Island& island, Real duration, bool solved, SolverPatience& patience);

  std::unique_ptr<ExactContacts> exact;

 private:
  uint32_t wait_ = 0;    // sub-steps until the next attempt
  Real debt_ = 0;        // [ns]
  bool proven_ = false;  // the last attempt was cheap
};

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
