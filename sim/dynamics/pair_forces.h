#pragma once
/// The forces of particles on each other (physics P2): gravitation, charges, Lennard-Jones.

#include <span>
#include <vector>

#include "sim/dynamics/force_field.h"
#include "sim/dynamics/integrator.h"

namespace offstage::sim {

/// A particle that a pairwise force acts on.
struct PairMember {
  std::size_t place;  ///< in the state, in units of 3
  Real mass, charge;
};

/// Of the particles in a flat state, x y z after each other. Each particle sums up what pulls at it, in an
/// order that depends on the state alone, so results are the same for any number of threads; of a pair both
/// get the same force to the bit, but for its sign.
class PairForces {
 public:
  /// `def` must be pairwise and outlive this.
  void add(const ForceDef& def, std::vector<PairMember> members) {
    groups_.push_back({&def, std::move(members)});
  }
  bool empty() const { return groups_.empty(); }

  /// Adds to the accelerations `dv` at positions `x`.
  void accelerate(Real t, std::span<const Real> x, std::span<Real> dv) const;
  /// Appends the derivatives of dv/dt by x, which begin at row `at_v` and column `at_x`. Exact among up to
  /// kExactJacobian particles; among more, what they do to each other's is left out, because its places would
  /// change with the state.
  void jacobian(Real t, std::span<const Real> x, int at_x, int at_v, SparseEntries& entries) const;
  /// [J]; 0 at infinity, or at the cut-off distance. Strengths in a region count as they are.
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
