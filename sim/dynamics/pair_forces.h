#pragma once
/// Forces between particles (physics P2): gravitation, Coulomb, Lennard-Jones.

#include <span>
#include <vector>

#include "sim/dynamics/force_field.h"
#include "sim/dynamics/integrator.h"

namespace offstage::sim {

/// A particle on which a pairwise force acts.
struct PairMember {
  std::size_t place;  ///< position in the state, in units of 3 numbers
  Real mass, charge;
};

/// Forces between particles in a flat state (x y z of each particle). Each particle sums the forces on it in
/// an order that depends only on the state, so results are the same for any number of threads. The two forces
/// of a pair are opposite to the last bit.
class PairForces {
 public:
  /// Adds a force between the particles `members`. `def` must be pairwise and outlive this object.
  void add(const ForceDef& def, std::vector<PairMember> members) {
    groups_.push_back({&def, std::move(members)});
  }
  bool empty() const { return groups_.empty(); }

  /// Adds the accelerations by the forces at the positions `x` to `dv`.
  void accelerate(std::span<const Real> x, std::span<Real> dv) const;
  /// Appends the derivatives of dv/dt by x, which begin at row `at_v` and column `at_x`. They are exact for
  /// up to kExactJacobian particles. For more particles the derivatives between different particles are
  /// omitted, because their pattern would change with the state.
  void jacobian(std::span<const Real> x, int at_x, int at_v, SparseEntries& entries) const;
  /// Potential energy [J]; 0 at infinity, or at the cut-off distance. Strengths in a region count as constant
  /// factors.
  Real potential_energy(Real t, std::span<const Real> x) const;

  static constexpr std::size_t kExactJacobian = 128;

 private:
  struct Group {
    const ForceDef* def;
    std::vector<PairMember> members;
  };
  std::vector<Group> groups_;
};

}  // namespace offstage::sim
