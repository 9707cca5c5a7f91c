#pragma once
/// Cholesky factorisation of a sparse symmetric positive definite matrix of 6 x 6 blocks, one row of blocks
/// for each body. Bodies are eliminated in an order of approximate minimum degree, so that a stack or a chain
/// of n costs O(n), a wall about O(n^1.5) (physics N11).

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sim/types.h"

namespace offstage::sim {

using Mat6 = Eigen::Matrix<Real, 6, 6>;
using Vec6 = Eigen::Matrix<Real, 6, 1>;

class BlockCholesky {
 public:
  /// Prepares for matrices whose blocks off the diagonal are at the given pairs of rows, first < second, each
  /// once and in ascending order. Does nothing if that is what it is prepared for.
  void analyze(uint32_t rows, std::span<const std::pair<uint32_t, uint32_t>> pairs);

  /// Blocks (first, second) of the upper triangle, in the order of the pairs. False if the matrix is not
  /// positive definite to rounding; then there is nothing to solve with.
  bool factorize(std::span<const Mat6> diagonal, std::span<const Mat6> pairs);

  /// x := A^-1 x.
  void solve(std::span<Vec6> x) const;

  uint32_t rows() const { return static_cast<uint32_t>(order_.size()); }
  /// Blocks of the factor, the diagonal included: what solve() costs.
  std::size_t factor_blocks() const { return row_.size() + order_.size(); }
  /// Products of two blocks in factorize().
  std::size_t factor_products() const { return products_; }

 private:
  void order(uint32_t rows);
  void find_columns(uint32_t rows);

  std::vector<std::pair<uint32_t, uint32_t>> pairs_;
  std::vector<uint32_t> order_, place_;  // order_[k]: the row eliminated k-th; place_: its inverse
  std::vector<uint32_t> begin_, row_;  // columns of L under the diagonal, in order of elimination, ascending
  std::vector<uint32_t> pair_at_;      // where in row_ the block of each pair goes
  std::size_t products_ = 0;
  std::vector<Mat6> diagonal_, below_;  // L; the diagonal holds the inverses of its triangles
};

}  // namespace offstage::sim
