#pragma once
/// The Cholesky factorisation of a symmetric matrix that gains and loses rows (Golub and Van Loan, Matrix
/// Computations, 6.5): for pivoting methods, whose active set changes by one index at a time (N9).

#include <vector>

#include <Eigen/Core>

#include "sim/core/types.h"

namespace offstage::sim {

/// L L^T of the rows and columns that were appended and not removed, in that order. O(n^2) each.
class UpdatedCholesky {
 public:
  /// A row whose pivot is this small a part of its diagonal is a combination of the ones before.
  static constexpr Real kDependent = 1e-10;

  explicit UpdatedCholesky(Eigen::Index capacity);

  Eigen::Index size() const { return size_; }
  /// Appends a row and column with these `couplings` to the others. False, and nothing done, if dependent.
  bool append(const Eigen::VectorXd& couplings, Real diagonal);
  void remove(Eigen::Index i);
  /// Replaces a right-hand side by the solution.
  void solve(Eigen::VectorXd& x) const;

 private:
  Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> lower_;
  std::vector<Real> cosines_, sines_;  ///< of remove()
  Eigen::Index size_ = 0;
};

}  // namespace offstage::sim
