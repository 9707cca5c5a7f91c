#include "sim/linear/block_cholesky.h"

#include <algorithm>
#include <cmath>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

namespace offstage::sim {
namespace {

/// Computes the inverse of the Cholesky factor of a block; returns false if the block is not positive
/// definite.
template <int N>
bool invert_factor(const Eigen::Matrix<Real, N, N>& block, Eigen::Matrix<Real, N, N>& inverse) {
  Eigen::Matrix<Real, N, N> L = Eigen::Matrix<Real, N, N>::Zero();
  for (int j = 0; j < N; ++j) {
    Real d = block(j, j);
    for (int k = 0; k < j; ++k) d -= L(j, k) * L(j, k);
    if (!(d > 0) || !std::isfinite(d)) return false;
    L(j, j) = std::sqrt(d);
    for (int i = j + 1; i < N; ++i) {
      Real s = block(i, j);
      for (int k = 0; k < j; ++k) s -= L(i, k) * L(j, k);
      L(i, j) = s / L(j, j);
    }
  }
  inverse.setZero();
  for (int j = 0; j < N; ++j) {
    inverse(j, j) = 1 / L(j, j);
    for (int i = j + 1; i < N; ++i) {
      Real s = 0;
      for (int k = j; k < i; ++k) s -= L(i, k) * inverse(k, j);
      inverse(i, j) = s / L(i, i);
    }
  }
  return true;
}

}  // namespace

template <int N>
void BlockCholesky<N>::analyze(uint32_t rows, std::span<const std::pair<uint32_t, uint32_t>> pairs,
                               std::span<const BlockRowKind> kinds) {
  if (rows == order_.size() && std::equal(pairs.begin(), pairs.end(), pairs_.begin(), pairs_.end()) &&
      std::equal(kinds.begin(), kinds.end(), kinds_.begin(), kinds_.end()))
    return;
  pairs_.assign(pairs.begin(), pairs.end());
  kinds_.assign(kinds.begin(), kinds.end());
  order(rows);
  if (!kinds_.empty()) put_empty_rows_after_neighbours();
  sign_.assign(rows, 1);
  for (uint32_t k = 0; k < rows; ++k)
    if (!kinds_.empty() && kinds_[order_[k]].is_negative) sign_[k] = -1;
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

template <int N>
void BlockCholesky<N>::order(uint32_t rows) {
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

/// Moves each empty row directly behind the last of its neighbours. If it followed only some of its
/// neighbours, its pivot could be zero.
template <int N>
void BlockCholesky<N>::put_empty_rows_after_neighbours() {
  std::vector<uint32_t> last = place_;
  for (const auto& [i, j] : pairs_) {
    if (kinds_[i].is_empty) last[i] = std::max(last[i], place_[j]);
    if (kinds_[j].is_empty) last[j] = std::max(last[j], place_[i]);
  }
  const auto key = [&](uint32_t row) { return std::pair(last[row], kinds_[row].is_empty); };
  std::stable_sort(order_.begin(), order_.end(), [&](uint32_t a, uint32_t b) { return key(a) < key(b); });
  for (uint32_t k = 0; k < order_.size(); ++k) place_[order_[k]] = k;
}

/// Finds the columns of the factor. A column has the blocks of the matrix and the fill-in from earlier
/// columns.
template <int N>
void BlockCholesky<N>::find_columns(uint32_t rows) {
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

template <int N>
bool BlockCholesky<N>::factorize(std::span<const Block> diagonal, std::span<const Block> pairs) {
  const auto n = static_cast<uint32_t>(order_.size());
  for (uint32_t k = 0; k < n; ++k) diagonal_[k] = diagonal[order_[k]];
  std::fill(below_.begin(), below_.end(), Block::Zero());
  for (std::size_t e = 0; e < pairs_.size(); ++e) {
    // The lower triangle needs the block whose row is eliminated later.
    if (place_[pairs_[e].first] < place_[pairs_[e].second])
      below_[pair_at_[e]] = pairs[e].transpose();
    else
      below_[pair_at_[e]] = pairs[e];
  }
  Block inverse;
  for (uint32_t j = 0; j < n; ++j) {
    if (!invert_factor<N>(sign_[j] < 0 ? Block(-diagonal_[j]) : diagonal_[j], inverse)) return false;
    diagonal_[j] = inverse;
    const uint32_t first = begin_[j], last = begin_[j + 1];
    for (uint32_t p = first; p < last; ++p) below_[p] = (below_[p] * inverse.transpose()).eval();
    // The stored blocks below the diagonal are L S. Multiplying by the sign again gives the rows of L.
    for (uint32_t q = first; q < last; ++q) {
      const uint32_t column = row_[q];
      const Block row = sign_[j] * below_[q];
      diagonal_[column].noalias() -= below_[q] * row.transpose();
      uint32_t at = begin_[column];
      for (uint32_t p = q + 1; p < last; ++p) {
        while (row_[at] != row_[p]) ++at;
        below_[at].noalias() -= below_[p] * row.transpose();
      }
    }
  }
  return true;
}

template <int N>
void BlockCholesky<N>::solve(std::span<Vector> x) const {
  const auto n = static_cast<uint32_t>(order_.size());
  for (uint32_t j = 0; j < n; ++j) {
    const Vector y = sign_[j] * (diagonal_[j] * x[order_[j]]);
    x[order_[j]] = y;
    for (uint32_t p = begin_[j]; p < begin_[j + 1]; ++p) x[order_[row_[p]]].noalias() -= below_[p] * y;
  }
  for (uint32_t j = n; j-- > 0;) {
    Vector y = x[order_[j]];
    for (uint32_t p = begin_[j]; p < begin_[j + 1]; ++p)
      y.noalias() -= sign_[j] * (below_[p].transpose() * x[order_[row_[p]]]);
    x[order_[j]] = diagonal_[j].transpose() * y;
  }
}

template class BlockCholesky<3>;
template class BlockCholesky<6>;

}  // namespace offstage::sim
