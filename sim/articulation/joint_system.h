#pragma once
/// The linear system of an articulation's joints (physics A1). The matrix is A = J M^-1 J^T + S, with the
/// mass matrix M of the links, the Jacobian J of the constraints and their softness S. It has a block row for
/// each joint, and couples joints that share a link. A link with many joints, which would couple all of them,
/// gets its own block row instead, so that the cost for a tree of n joints is O(n). If joints form loops,
/// rows may be linearly dependent. A small fraction of the diagonal is then added, and conjugate gradients
/// remove the resulting error.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/articulation/joint_rows.h"
#include "sim/linear/block_cholesky.h"

namespace offstage::sim {

class JointSystem {
 public:
  static constexpr uint32_t kDriven = UINT32_MAX;  ///< index used for a link that forces do not move
  struct Topology {
    uint32_t a, b;  ///< indices of the two links; kDriven: a link that forces do not move
    uint32_t rows;  ///< number of constraints
  };

  /// The joints must connect all links.
  JointSystem(uint32_t links, std::vector<Topology> joints);

  /// Factors the system of these rows, to which the object keeps a reference. Returns false if the
  /// constraints are too degenerate. correct() then does nothing.
  bool factorize(std::span<const JointRows> rows, std::span<const LinkMobility> links);

  /// Replaces the constraints by rows that differ little from the rows of the last factorize(). The factor is
  /// kept, so correct() must be iterated.
  void update(std::span<const JointRows> rows) { rows_ = rows; }

  /// Computes J v for all joints. Driven links count as motionless.
  void relative(std::span<const Vec6> velocities, std::span<Vec6> result) const;
  /// Computes the impulses p that change J v by `change` - S p and applies them: velocities += M^-1 J^T p.
  /// Does nothing if factorize() failed.
  void correct(std::span<const Vec6> change, std::span<Vec6> impulses, std::span<Vec6> velocities);

  std::span<const Topology> joints() const { return joints_; }
  std::span<const JointRows> rows() const { return rows_; }
  std::span<const LinkMobility> links() const { return links_; }
  bool has_loops() const { return has_loops_; }

 private:
  /// The matrix with blocks of N x N.
  template <int N>
  struct Matrix {
    std::vector<Eigen::Matrix<Real, N, N>> diagonal, off;
    std::vector<Eigen::Matrix<Real, N, 1>> x;
    BlockCholesky<N> factor;
  };
  /// Off-diagonal block: two joints that share a link, or a joint and a link with a row of its own.
  struct Coupling {
    uint32_t first, second;  // rows
    uint32_t link;
    uint32_t pair;
  };

  void find_couplings();
  template <int N>
  bool factorize(Matrix<N>& m);
  template <int N>
  Eigen::Matrix<Real, N, 1> own_diagonal(std::size_t joint) const;
  template <int N>
  void solve(Matrix<N>& m, std::span<Vec6> x);
  void solve(std::span<Vec6> x);
  void refine(std::span<const Vec6> change, std::span<Vec6> impulses);
  void apply(std::span<const Vec6> impulses, std::span<Vec6> velocities) const;
  /// Whether the matrix is well-conditioned and positive definite, so that no refinement is needed.
  bool is_plain() const { return !has_loops_ && hubs_.empty(); }
  bool is_hub(uint32_t link) const { return hub_row_[link] != kDriven; }

  std::vector<Topology> joints_;
  std::vector<uint32_t> hub_row_;  // by link; kDriven: no row of its own
  std::vector<uint32_t> hubs_;
  std::vector<BlockRowKind> kinds_;
  std::vector<std::pair<uint32_t, uint32_t>> pairs_;
  std::vector<Coupling> couplings_;
  bool has_loops_ = false, is_small_ = false, is_factored_ = false, needs_refinement_ = false;

  std::span<const JointRows> rows_;
  std::vector<LinkMobility> links_;
  std::vector<Mat6> response_a_, response_b_;  // M^-1 J^T of each joint
  Matrix<3> small_;                            // used if no joint has more than three constraints
  Matrix<6> large_;
  std::vector<Vec6> residual_, part_, direction_, product_, given_;
};

}  // namespace offstage::sim
