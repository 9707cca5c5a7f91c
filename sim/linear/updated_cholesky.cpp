#include "sim/linear/updated_cholesky.h"

#include <cmath>

namespace offstage::sim {

UpdatedCholesky::UpdatedCholesky(Eigen::Index capacity)
    : lower_(capacity, capacity),
      cosines_(static_cast<std::size_t>(capacity)),
      sines_(static_cast<std::size_t>(capacity)) {}

bool UpdatedCholesky::append(const Eigen::VectorXd& couplings, Real diagonal) {
  const Eigen::Index n = size_;
  Real pivot = diagonal;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Real y = (couplings[i] - lower_.row(i).head(i).dot(lower_.row(n).head(i))) / lower_(i, i);
    lower_(n, i) = y;
    pivot -= y * y;
  }
  if (!(pivot > kDependent * diagonal)) return false;
  lower_(n, n) = std::sqrt(pivot);
  ++size_;
  return true;
}

// The rows below move up and reach one column beyond the diagonal; one rotation of two columns per row
// restores the triangle. The loop goes row by row, so that memory is read in order.
void UpdatedCholesky::remove(Eigen::Index first) {
  --size_;
  for (Eigen::Index r = first; r < size_; ++r) {
    lower_.row(r).head(r + 2) = lower_.row(r + 1).head(r + 2);
    Real* row = &lower_(r, 0);
    for (Eigen::Index c = first; c < r; ++c) {
      const auto k = static_cast<std::size_t>(c);
      const Real x = row[c], y = row[c + 1];
      row[c] = cosines_[k] * x + sines_[k] * y;
      row[c + 1] = cosines_[k] * y - sines_[k] * x;
    }
    const Real length = std::sqrt(row[r] * row[r] + row[r + 1] * row[r + 1]);
    cosines_[static_cast<std::size_t>(r)] = row[r] / length;
    sines_[static_cast<std::size_t>(r)] = row[r + 1] / length;
    row[r] = length;
  }
}

void UpdatedCholesky::solve(Eigen::VectorXd& x) const {
  for (Eigen::Index i = 0; i < size_; ++i)
    x[i] = (x[i] - lower_.row(i).head(i).dot(x.head(i))) / lower_(i, i);
  for (Eigen::Index i = size_ - 1; i >= 0; --i) {
    x[i] /= lower_(i, i);
    x.head(i) -= x[i] * lower_.row(i).head(i).transpose();
  }
}

}  // namespace offstage::sim
