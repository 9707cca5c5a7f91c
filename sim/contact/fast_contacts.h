#pragma once
/// Contacts of several islands at once, by the fast solver (physics N12).

#include <span>
#include <vector>

#include "sim/contact/island_joints.h"
#include "sim/contact/relaxation.h"
#include "sim/contact/relaxed_joints.h"

namespace offstage::sim {

/// Solves the contacts of several islands at once by the fast solver.
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
  void collect_link_contacts();

  // Movable bodies first, then one entry for each contact with an immovable body.
  std::vector<Body*> members_;
  std::size_t moved_ = 0;
  std::vector<RelaxedBody> bodies_;
  std::vector<Origin> origins_;  // origins of the patches
  std::vector<ContactPatch> patches_;
  IslandJoints joints_;
  std::vector<LinkContact> link_contacts_;
  RelaxationSolver solver_;
};

}  // namespace offstage::sim
