#pragma once
/// Cholesky factorization L S L^T of a sparse symmetric matrix of N x N blocks, one row of blocks for each
/// body or joint. S is a diagonal matrix with a sign for each row; all signs are positive if the matrix is
/// positive definite. Rows are eliminated in an order of approximate minimum degree, so that a stack or a
/// chain of n costs O(n), a wall about O(n^1.5) (physics N11, A1).
///
/// With bodies as positive rows and joints as negative rows the matrix is quasi-definite (Vanderbei,
/// "Symmetric quasidefinite matrices", 1995). It has this factorization in any order of elimination in which
/// a row with a zero on the diagonal comes after its neighbours.

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sim/core/types.h"

namespace offstage::sim {

using Mat6 = Eigen::Matrix<Real, 6, 6>;
using Vec6 = Eigen::Matrix<Real, 6, 1>;

/// Properties of a row of blocks that are known before the factorization.
struct BlockRowKind {
  bool is_negative = false;  ///< whether its sign in S is negative
  /// Whether the diagonal block of the row is zero: its neighbours are then eliminated first.
  bool is_empty = false;
  friend bool operator==(const BlockRowKind&, const BlockRowKind&) = default;
};

template <int N>
class BlockCholesky {
 public:
  using Block = Eigen::Matrix<Real, N, N>;
  using Vector = Eigen::Matrix<Real, N, 1>;

  /// Analyzes a block sparsity pattern with `rows` rows. `pairs`: (row, column) of each off-diagonal block,
  /// first < second, without duplicates and in ascending order. `kinds`: properties of each row; by default
  /// all are positive. Does nothing if the last analysis had the same arguments.
  void analyze(uint32_t rows, std::span<const std::pair<uint32_t, uint32_t>> pairs,
               std::span<const BlockRowKind> kinds = {});

  /// Computes the factorization. `pairs`: blocks of the upper triangle, in the order of the pairs given to
  /// analyze(). Returns false if a pivot does not have the expected sign within rounding; solve() must not be
  /// called then.
  bool factorize(std::span<const Block> diagonal, std::span<const Block> pairs);

  /// Replaces x by A^-1 x.
  void solve(std::span<Vector> x) const;

  uint32_t rows() const { return static_cast<uint32_t>(order_.size()); }
  /// Number of blocks of the factor including the diagonal; the cost of solve() is proportional to it.
  std::size_t factor_blocks() const { return row_.size() + order_.size(); }
  /// Number of multiplications of two blocks in factorize(), a measure of its cost.
  std::size_t factor_products() const { return products_; }

 private:
  void order(uint32_t rows);
  void put_empty_rows_after_neighbours();
  void find_columns(uint32_t rows);

  std::vector<std::pair<uint32_t, uint32_t>> pairs_;
  std::vector<BlockRowKind> kinds_;
  std::vector<Real> sign_;               // by position in the order of elimination
  std::vector<uint32_t> order_, place_;  // order_[k]: the row eliminated k-th; place_: its inverse
  std::vector<uint32_t> begin_, row_;  // columns of L under the diagonal, in order of elimination, ascending
  std::vector<uint32_t> pair_at_;      // index in row_ of the block of each pair
  std::size_t products_ = 0;
  std::vector<Block> diagonal_, below_;  // blocks of L; diagonal_ holds the inverses of the triangular blocks
};

extern template class BlockCholesky<3>;
extern template class BlockCholesky<6>;

}  // namespace offstage::sim
