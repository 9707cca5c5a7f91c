#pragma once
/// Baraff's pivoting on contacts with friction (physics N10; "Fast contact force computation for
/// nonpenetrating rigid bodies", 1994), in matrix form. Normals and tangents are added one at a time, and the
/// conditions of those added before stay satisfied. Success is not guaranteed: see PivotingResult.

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "sim/core/types.h"

namespace offstage::sim {

/// Contacts as a linear system for the impulses: u = A p + b, with three rows (n, t, k) for each contact. The
/// target normal velocities are subtracted from b.
struct DenseContacts {
  Eigen::MatrixXd A;                      ///< J M^-1 J^T, symmetric, positive semidefinite [1/kg]
  Eigen::VectorXd b;                      ///< [m/s]
  std::vector<Eigen::Vector2d> friction;  ///< coefficients of friction of each contact, along t and along k
  /// For each contact, whether it has dynamic friction: p_t = -mu p_n and p_k = 0 at any tangential velocity.
  std::vector<uint8_t> slides;
  /// Optional: rows excluded from pivoting. Their normal impulse is fixed at 1, so that the limits of their
  /// tangents are constant. The rows and columns of these normals in A and b are zero.
  std::vector<uint8_t> held = {};

  std::size_t count() const { return friction.size(); }
};

struct PivotingResult {
  uint32_t pivots = 0;
  /// Whether the impulses are the solution. It is false after an unbounded step, cycling, a singular matrix
  /// or too many pivots. The impulses then only satisfy their limits.
  bool solved = true;
};

/// Computes the impulses p [N s], starting from zero, with a separate friction limit for each tangent.
/// Contacts are added in cyclic order beginning with `first`; if one order fails, another may succeed.
PivotingResult pivot(const DenseContacts& contacts, std::size_t first, Eigen::VectorXd& p);

}  // namespace offstage::sim
