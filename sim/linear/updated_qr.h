#pragma once
/// The QR factorization of a square matrix whose rows and columns are added, removed and replaced (Golub and
/// Van Loan, Matrix Computations, 6.5). It is used for pivoting on matrices without symmetry, which sliding
/// friction produces (N10).

#include <Eigen/Core>

#include "sim/core/types.h"

namespace offstage::sim {

/// The product Q R with an explicit Q. Each change takes O(n^2) by Givens rotations.
class UpdatedQr {
 public:
  explicit UpdatedQr(Eigen::Index capacity) : q_(capacity, capacity), r_(capacity, capacity) {}

  Eigen::Index size() const { return size_; }
  /// Appends a last row and a last column with the common element `corner`.
  void append(const Eigen::VectorXd& row, const Eigen::VectorXd& column, Real corner);
  /// Removes a row and a column; later rows and columns move up.
  void remove(Eigen::Index row, Eigen::Index column);
  /// Removes a column and appends `by` as the last column; later columns move up.
  void replace(Eigen::Index column, const Eigen::VectorXd& by);
  /// Replaces a right-hand side by the solution. Returns false, with x undefined, if the matrix is singular.
  bool solve(Eigen::VectorXd& x) const;

 private:
  void rotate(Eigen::Index upper, Eigen::Index lower, Eigen::Index from, Real x, Real y);
  void drop_column(Eigen::Index column);

  Eigen::MatrixXd q_;
  Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> r_;
  Eigen::Index size_ = 0;
};

}  // namespace offstage::sim
