#pragma once
/// Bodies that ride on kinematic bodies (physics R9). Static friction makes such a body follow the pose of
/// its carrier. The mean of the velocities at the start and the end of an interval times its length is the
/// displacement of the body only to second order: on a turntable, the body would lag behind by a twelfth of
/// the cube of the angle in each sub-step.

#include <span>
#include <vector>

#include "sim/contact/closing_contacts.h"
#include "sim/contact/contact_graph.h"

namespace offstage::sim {

class RidingBodies {
 public:
  /// Finds the bodies of an island that ride on a kinematic body throughout an interval of length `duration`
  /// [s]. They push on it or on other riding bodies, and move with it at the start and at the end.
  /// `bodies` has the velocities at the end; `contacts` and `pairs` belong together.
  void find(const Island& island, std::span<const ContactBody> bodies, std::span<const Contact> contacts,
            std::span<const ContactPair* const> pairs, Real duration);

  /// Whether points fixed on a body have accelerations, because it is kinematic and turns or speeds up.
  static bool can_carry(const Body& body);
  void clear() { carriers_.clear(); }
  bool empty() const { return carriers_.empty(); }
  /// Returns the displacement in the interval of a point fixed on the carrier at the place of the i-th body,
  /// minus the displacement by the mean of its velocities at the start and the end. Zero if it does not ride.
  const Displacement& deviation(std::size_t i) const { return deviations_[i]; }

 private:
  bool board(const Island& island, std::span<const ContactBody> bodies, std::size_t i, const Body& carrier,
             Real duration);

  std::vector<const Body*> carriers_;  // by body; null: it does not ride. Empty: no body does
  std::vector<Displacement> deviations_;
};

}  // namespace offstage::sim
