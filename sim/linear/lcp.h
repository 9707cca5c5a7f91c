#pragma once
/// Solves linear complementarity problems with a symmetric positive semidefinite matrix, such as contact
/// forces without friction, by Dantzig's method (physics N9; Baraff, "Fast contact force computation for
/// nonpenetrating rigid bodies", 1994). Contacts are added one at a time, and the forces change so that all
/// contacts added before stay solved.

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "sim/core/types.h"

namespace offstage::sim {

struct LcpSolution {
  Eigen::VectorXd f;                ///< >= 0
  uint32_t pivots = 0;              ///< number of steps of Dantzig's method
  bool fell_back = false;           ///< whether the result is from projected Gauss-Seidel, the fall-back
  std::vector<uint32_t> unbounded;  ///< indices at which a >= 0 is impossible for any force
  /// Greatest |min(A_ii f_i, a_i)| over the indices that are not unbounded, in the unit of b.
  Real residual = 0;
};

/// Finds f such that a = A f + b >= 0, f >= 0, f.a = 0. A may be singular, for example for redundant
/// contacts. Some of the dependent rows then have f = 0. If no such f exists (b is outside of the range of
/// A), `unbounded` lists the indices at which a < 0 remains.
LcpSolution solve_lcp(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

}  // namespace offstage::sim
