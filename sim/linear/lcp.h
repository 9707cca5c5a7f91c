#pragma once
/// Contact forces without friction: the linear complementarity problem of a symmetric positive semidefinite
/// matrix by Dantzig's method (physics N9; Baraff, "Fast contact force computation for nonpenetrating rigid
/// bodies", 1994). Contacts are brought in one at a time, and the forces of those in contact follow so that
/// all before stay solved.

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "sim/core/types.h"

namespace offstage::sim {

struct LcpSolution {
  Eigen::VectorXd f;                ///< >= 0
  uint32_t pivots = 0;              ///< steps, each ended by an index that blocks
  bool fell_back = false;           ///< ended with projected Gauss-Seidel
  std::vector<uint32_t> unbounded;  ///< indices that no force, however large, brings to a >= 0
  Real residual = 0;                ///< greatest |min(A_ii f_i, a_i)| but for the unbounded, in units of b
};

/// f such that a = A f + b >= 0, f >= 0, f.a = 0. A may be singular, as it is with redundant contacts: of
/// dependent rows some are left at f = 0. Where no f does it (b outside of the range), `unbounded` says so.
LcpSolution solve_lcp(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

}  // namespace offstage::sim
