#pragma once
/// The linear system of an articulation's joints (physics A1): with M the masses of its links and J its
/// constraints, A = J M^-1 J^T has a block row for each joint and couples those that share a link. Links of
/// many joints, which would couple all of them with each other, stay in the system as rows of their own, so
/// that any tree costs O(n). Where joints form loops, rows may depend on each other: then a small part of the
/// diagonal is added, and what that takes away is given back by conjugate gradients.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/articulation/joint_rows.h"
#include "sim/linear/block_cholesky.h"

namespace offstage::sim {

class JointSystem {
 public:
  static constexpr uint32_t kDriven = UINT32_MAX;  ///< in place of a link: none that forces move
  struct Topology {
    uint32_t a, b;  ///< links, or kDriven
    uint32_t rows;  ///< constraints
  };

  /// The joints must connect all links.
  JointSystem(uint32_t links, std::vector<Topology> joints);

  /// Factors the system of rows that the caller keeps. False, and nothing can be solved, if the constraints
  /// are degenerate beyond help.
  bool factorize(std::span<const JointRows> rows, std::span<const LinkMobility> links);

  /// Takes constraints that are near those of the last factorize(), whose factor goes on to serve: correct()
  /// is then to be repeated.
  void update(std::span<const JointRows> rows) { rows_ = rows; }

  /// J v of the joints; driven links count as still.
  void relative(std::span<const Vec6> velocities, std::span<Vec6> result) const;
  /// The impulses p that change J v by `change`, and what they do: velocities += M^-1 J^T p. Without success
  /// of factorize() nothing.
  void correct(std::span<const Vec6> change, std::span<Vec6> impulses, std::span<Vec6> velocities);

  std::span<const Topology> joints() const { return joints_; }
  std::span<const JointRows> rows() const { return rows_; }
  std::span<const LinkMobility> links() const { return links_; }
  bool has_loops() const { return has_loops_; }

 private:
  /// The matrix with blocks of one size.
  template <int N>
  struct Matrix {
    std::vector<Eigen::Matrix<Real, N, N>> diagonal, off;
    std::vector<Eigen::Matrix<Real, N, 1>> x;
    BlockCholesky<N> factor;
  };
  /// Two joints at a link, or a joint and a link that has a row of its own.
  struct Coupling {
    uint32_t first, second;  // rows
    uint32_t link;
    uint32_t pair;
  };

  void find_couplings();
  template <int N>
  bool factorize(Matrix<N>& m);
  template <int N>
  void solve(Matrix<N>& m, std::span<Vec6> x);
  void solve(std::span<Vec6> x);
  void refine(std::span<const Vec6> change, std::span<Vec6> impulses);
  void apply(std::span<const Vec6> impulses, std::span<Vec6> velocities) const;
  /// Positive definite by far: no refinement is needed.
  bool is_plain() const { return !has_loops_ && hubs_.empty(); }
  bool is_hub(uint32_t link) const { return hub_row_[link] != kDriven; }

  std::vector<Topology> joints_;
  std::vector<uint32_t> hub_row_;  // by link; kDriven: it has none
  std::vector<uint32_t> hubs_;
  std::vector<BlockRowKind> kinds_;
  std::vector<std::pair<uint32_t, uint32_t>> pairs_;
  std::vector<Coupling> couplings_;
  bool has_loops_ = false, is_small_ = false, is_factored_ = false, needs_refinement_ = false;

  std::span<const JointRows> rows_;
  std::vector<LinkMobility> links_;
  std::vector<Mat6> response_a_, response_b_;  // M^-1 J^T of each joint
  Matrix<3> small_;                            // where no joint has more than three constraints
  Matrix<6> large_;
  std::vector<Vec6> residual_, part_, direction_, product_, given_;
};

}  // namespace offstage::sim
