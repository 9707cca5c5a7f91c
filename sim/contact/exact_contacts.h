#pragma once
/// Contacts of one island, by the exact solver (physics R8, R9, N11).

#include <vector>

#include "sim/contact/island_joints.h"
#include "sim/contact/proximal_newton.h"

namespace offstage::sim {

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

}  // namespace offstage::sim
