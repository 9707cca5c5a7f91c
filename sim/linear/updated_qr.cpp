#include "sim/linear/updated_qr.h"

#include <cmath>

namespace offstage::sim {
namespace {

/// A diagonal element below this fraction of the greatest one counts as zero.
constexpr Real kSingular = 1e-13;

}  // namespace

/// Applies the rotation that takes (x, y) to (|(x, y)|, 0). It changes two rows of R, from the column `from`
/// on, and two columns of Q.
void UpdatedQr::rotate(Eigen::Index upper, Eigen::Index lower, Eigen::Index from, Real x, Real y) {
  if (y == 0) return;
  const Real length = std::sqrt(x * x + y * y), c = x / length, s = y / length;
  for (Eigen::Index j = from; j < size_; ++j) {
    const Real u = r_(upper, j), l = r_(lower, j);
    r_(upper, j) = c * u + s * l;
    r_(lower, j) = c * l - s * u;
  }
  for (Eigen::Index i = 0; i < size_; ++i) {
    const Real u = q_(i, upper), l = q_(i, lower);
    q_(i, upper) = c * u + s * l;
    q_(i, lower) = c * l - s * u;
  }
}

void UpdatedQr::append(const Eigen::VectorXd& row, const Eigen::VectorXd& column, Real corner) {
  const Eigen::Index n = size_++;
  r_.col(n).head(n).noalias() = q_.topLeftCorner(n, n).transpose() * column.head(n);
  r_.row(n).head(n) = row.head(n).transpose();
  r_(n, n) = corner;
  q_.row(n).head(n).setZero();
  q_.col(n).head(n).setZero();
  q_(n, n) = 1;
  for (Eigen::Index j = 0; j < n; ++j) {
    rotate(j, n, j, r_(j, j), r_(n, j));
    r_(n, j) = 0;
  }
}

/// Removes a column and leaves R triangular except for its last column, which the caller sets.
void UpdatedQr::drop_column(Eigen::Index column) {
  for (Eigen::Index i = 0; i < size_; ++i)
    for (Eigen::Index j = column; j + 1 < size_; ++j) r_(i, j) = r_(i, j + 1);
  r_.col(size_ - 1).head(size_).setZero();
  for (Eigen::Index j = column; j + 1 < size_; ++j) {
    rotate(j, j + 1, j, r_(j, j), r_(j + 1, j));
    r_(j + 1, j) = 0;
  }
}

void UpdatedQr::replace(Eigen::Index column, const Eigen::VectorXd& by) {
  drop_column(column);
  r_.col(size_ - 1).head(size_).noalias() = q_.topLeftCorner(size_, size_).transpose() * by.head(size_);
}

// Rotations change this row of Q to the last unit vector. The last column of Q is then a unit vector, too.
void UpdatedQr::remove(Eigen::Index row, Eigen::Index column) {
  drop_column(column);
  const Eigen::Index last = size_ - 1;
  for (Eigen::Index k = last - 1; k >= 0; --k) rotate(last, k, k, q_(row, last), q_(row, k));
  for (Eigen::Index i = row; i < last; ++i) q_.row(i).head(last) = q_.row(i + 1).head(last);
  size_ = last;
}

bool UpdatedQr::solve(Eigen::VectorXd& x) const {
  const auto R = r_.topLeftCorner(size_, size_);
  if (size_ == 0) return true;
  const auto sizes = R.diagonal().cwiseAbs();
  if (!(sizes.minCoeff() > kSingular * sizes.maxCoeff())) return false;
  x = (q_.topLeftCorner(size_, size_).transpose() * x).eval();
  R.triangularView<Eigen::Upper>().solveInPlace(x);
  return true;
}

}  // namespace offstage::sim
