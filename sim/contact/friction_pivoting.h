#pragma once
/// Baraff's pivoting on contacts with friction (physics N10; "Fast contact force computation for
/// nonpenetrating rigid bodies", 1994), in matrix form: normals and tangents are brought in one at a time,
/// and what was brought in stays solved. It is not sure to end well: see PivotingResult.

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "sim/core/types.h"

namespace offstage::sim {

/// Contacts as a linear system on impulses: u = A p + b, three rows (n, t, k) for each contact, with the
/// least normal velocities taken off b.
struct DenseContacts {
  Eigen::MatrixXd A;                      ///< J M^-1 J^T, symmetric, positive semidefinite [1/kg]
  Eigen::VectorXd b;                      ///< [m/s]
  std::vector<Eigen::Vector2d> friction;  ///< of each contact, along t and k
  /// Dynamic friction: p_t = -mu p_n and p_k = 0 whatever the tangential velocities become.
  std::vector<uint8_t> slides;

  std::size_t count() const { return friction.size(); }
};

struct PivotingResult {
  uint32_t pivots = 0;
  /// False after an unbounded step (the contact jams or pulls itself in), endless exchange, a singular matrix
  /// or too many pivots: the impulses are then allowed ones, but not the solution.
  bool solved = true;
};

/// The impulses from zero on, each tangent with its own limit. Contacts are brought in in order from `first`
/// on, those before it last: where one order ends badly, another may not.
PivotingResult pivot(const DenseContacts& contacts, std::size_t first, Eigen::VectorXd& p);

}  // namespace offstage::sim
