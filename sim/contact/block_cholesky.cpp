#include "sim/contact/block_cholesky.h"

#include <algorithm>
#include <cmath>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

namespace offstage::sim {
namespace {

/// The inverse of the triangle of a block's Cholesky factor; false if the block is not positive definite.
bool invert_factor(const Mat6& block, Mat6& inverse) {
  Mat6 L = Mat6::Zero();
  for (int j = 0; j < 6; ++j) {
    Real d = block(j, j);
    for (int k = 0; k < j; ++k) d -= L(j, k) * L(j, k);
    if (!(d > 0) || !std::isfinite(d)) return false;
    L(j, j) = std::sqrt(d);
    for (int i = j + 1; i < 6; ++i) {
      Real s = block(i, j);
      for (int k = 0; k < j; ++k) s -= L(i, k) * L(j, k);
      L(i, j) = s / L(j, j);
    }
  }
  inverse.setZero();
  for (int j = 0; j < 6; ++j) {
    inverse(j, j) = 1 / L(j, j);
    for (int i = j + 1; i < 6; ++i) {
      Real s = 0;
      for (int k = j; k < i; ++k) s -= L(i, k) * inverse(k, j);
      inverse(i, j) = s / L(i, i);
    }
  }
  return true;
}

}  // namespace

void BlockCholesky::analyze(uint32_t rows, std::span<const std::pair<uint32_t, uint32_t>> pairs) {
  if (rows == order_.size() && std::equal(pairs.begin(), pairs.end(), pairs_.begin(), pairs_.end())) return;
  pairs_.assign(pairs.begin(), pairs.end());
  order(rows);
  find_columns(rows);
  pair_at_.resize(pairs_.size());
  for (std::size_t e = 0; e < pairs_.size(); ++e) {
    const auto [column, row] = std::minmax(place_[pairs_[e].first], place_[pairs_[e].second]);
    const auto first = row_.begin() + begin_[column], last = row_.begin() + begin_[column + 1];
    pair_at_[e] = static_cast<uint32_t>(std::lower_bound(first, last, row) - row_.begin());
  }
  diagonal_.resize(rows);
  below_.resize(row_.size());
}

void BlockCholesky::order(uint32_t rows) {
  const auto n = static_cast<Eigen::Index>(rows);
  std::vector<Eigen::Triplet<Real, int>> entries;
  for (uint32_t i = 0; i < rows; ++i) entries.emplace_back(static_cast<int>(i), static_cast<int>(i), 1);
  for (const auto& [i, j] : pairs_) {
    entries.emplace_back(static_cast<int>(i), static_cast<int>(j), 1);
    entries.emplace_back(static_cast<int>(j), static_cast<int>(i), 1);
  }
  Eigen::SparseMatrix<Real> pattern(n, n);
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> p;
  Eigen::AMDOrdering<int>()(pattern, p);
  order_.resize(rows);
  place_.resize(rows);
  for (uint32_t k = 0; k < rows; ++k) {
    order_[k] = static_cast<uint32_t>(p.indices()[k]);
    place_[order_[k]] = k;
  }
}

/// The columns of the factor: those of the matrix, and all of a column passed on to its first row.
void BlockCholesky::find_columns(uint32_t rows) {
  std::vector<std::vector<uint32_t>> columns(rows);
  for (const auto& pair : pairs_) {
    const auto [column, row] = std::minmax(place_[pair.first], place_[pair.second]);
    columns[column].push_back(row);
  }
  begin_.assign(1, 0);
  row_.clear();
  products_ = 0;
  for (uint32_t j = 0; j < rows; ++j) {
    auto& column = columns[j];
    std::sort(column.begin(), column.end());
    column.erase(std::unique(column.begin(), column.end()), column.end());
    row_.insert(row_.end(), column.begin(), column.end());
    begin_.push_back(static_cast<uint32_t>(row_.size()));
    products_ += column.size() * (column.size() + 3) / 2;
    if (column.empty()) continue;
    auto& parent = columns[column[0]];
    parent.insert(parent.end(), column.begin() + 1, column.end());
    column = {};
  }
}

bool BlockCholesky::factorize(std::span<const Mat6> diagonal, std::span<const Mat6> pairs) {
  const auto n = static_cast<uint32_t>(order_.size());
  for (uint32_t k = 0; k < n; ++k) diagonal_[k] = diagonal[order_[k]];
  std::fill(below_.begin(), below_.end(), Mat6::Zero());
  for (std::size_t e = 0; e < pairs_.size(); ++e) {
    // The lower triangle wants the block whose row is eliminated later.
    if (place_[pairs_[e].first] < place_[pairs_[e].second])
      below_[pair_at_[e]] = pairs[e].transpose();
    else
      below_[pair_at_[e]] = pairs[e];
  }
  Mat6 inverse;
  for (uint32_t j = 0; j < n; ++j) {
    if (!invert_factor(diagonal_[j], inverse)) return false;
    diagonal_[j] = inverse;
    const uint32_t first = begin_[j], last = begin_[j + 1];
    for (uint32_t p = first; p < last; ++p) below_[p] = (below_[p] * inverse.transpose()).eval();
    for (uint32_t q = first; q < last; ++q) {
      const uint32_t column = row_[q];
      diagonal_[column].noalias() -= below_[q] * below_[q].transpose();
      uint32_t at = begin_[column];
      for (uint32_t p = q + 1; p < last; ++p) {
        while (row_[at] != row_[p]) ++at;
        below_[at].noalias() -= below_[p] * below_[q].transpose();
      }
    }
  }
  return true;
}

void BlockCholesky::solve(std::span<Vec6> x) const {
  const auto n = static_cast<uint32_t>(order_.size());
  for (uint32_t j = 0; j < n; ++j) {
    const Vec6 y = diagonal_[j] * x[order_[j]];
    x[order_[j]] = y;
    for (uint32_t p = begin_[j]; p < begin_[j + 1]; ++p) x[order_[row_[p]]].noalias() -= below_[p] * y;
  }
  for (uint32_t j = n; j-- > 0;) {
    Vec6 y = x[order_[j]];
    for (uint32_t p = begin_[j]; p < begin_[j + 1]; ++p)
      y.noalias() -= below_[p].transpose() * x[order_[row_[p]]];
    x[order_[j]] = diagonal_[j].transpose() * y;
  }
}

}  // namespace offstage::sim
