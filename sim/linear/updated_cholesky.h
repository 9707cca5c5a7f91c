#pragma once
/// The Cholesky factorization of a symmetric matrix to which rows are added and from which they are removed
/// (Golub and Van Loan, Matrix Computations, 6.5). Pivoting methods use it, because their active set changes
/// by one index at a time (N9).

#include <vector>

#include <Eigen/Core>

#include "sim/core/types.h"

namespace offstage::sim {

/// The factorization L L^T of the current rows and columns, in the order in which they were appended. Each
/// operation is O(n^2).
class UpdatedCholesky {
 public:
  /// A row whose pivot is less than this fraction of its diagonal counts as a linear combination of the rows
  /// before.
  static constexpr Real kDependent = 1e-10;

  explicit UpdatedCholesky(Eigen::Index capacity);

  Eigen::Index size() const { return size_; }
  /// Appends a row and column. `couplings`: its elements in the existing columns. Returns false and changes
  /// nothing if the new row is linearly dependent (kDependent).
  bool append(const Eigen::VectorXd& couplings, Real diagonal);
  void remove(Eigen::Index i);
  /// Replaces a right-hand side by the solution.
  void solve(Eigen::VectorXd& x) const;

 private:
  Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> lower_;
  std::vector<Real> cosines_, sines_;  ///< rotations of remove()
  Eigen::Index size_ = 0;
};

}  // namespace offstage::sim
