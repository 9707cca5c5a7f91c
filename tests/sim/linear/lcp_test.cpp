#include "sim/linear/lcp.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "sim/core/types.h"
#include "tests/convex_samples.h"

namespace offstage::sim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd random_lcp_matrix(Dice& dice, Index rows, Index columns) {
  MatrixXd m(rows, columns);
  for (Index i = 0; i < rows; ++i)
    for (Index j = 0; j < columns; ++j) m(i, j) = dice.uniform(-1, 1);
  return m;
}

/// Returns the reference solution. Tries all 2^n sets of active contacts.
VectorXd enumerated(const MatrixXd& A, const VectorXd& b) {
  const Index n = b.size();
  for (uint32_t set = 0; set < (1u << n); ++set) {
    std::vector<Index> held;
    for (Index i = 0; i < n; ++i)
      if (set >> i & 1) held.push_back(i);
    VectorXd f = VectorXd::Zero(n);
    if (!held.empty()) {
      const VectorXd part = MatrixXd(A(held, held)).ldlt().solve(-b(held));
      if (part.minCoeff() < 0) continue;
      f(held) = part;
    }
    const VectorXd a = A * f + b;
    bool good = true;
    for (Index i = 0; i < n; ++i) good = good && ((set >> i & 1) || a[i] >= 0);
    if (good) return f;
  }
  ADD_FAILURE() << "no solution";
  return VectorXd::Zero(n);
}

/// Checks the conditions of the LCP, relative to b.
void expect_solves(const LcpSolution& s, const MatrixXd& A, const VectorXd& b, Real tolerance) {
  const VectorXd a = A * s.f + b;
  const Real scale = b.cwiseAbs().maxCoeff();
  ASSERT_GE(s.f.minCoeff(), 0);
  ASSERT_GE(a.minCoeff(), -tolerance * scale);
  ASSERT_LE(std::abs(s.f.dot(a)), tolerance * scale * (1 + s.f.cwiseAbs().maxCoeff()));
  ASSERT_FALSE(s.fell_back);
  ASSERT_TRUE(s.unbounded.empty());
}

TEST(Lcp, RandomProblemsMatchEnumeration) {
  Dice dice(1);
  for (int trial = 0; trial < 400; ++trial) {
    const Index n = 1 + trial % 12;
    const MatrixXd J = random_lcp_matrix(dice, n, n + 1);
    const MatrixXd A = J * J.transpose();
    const VectorXd b = random_lcp_matrix(dice, n, 1);
    const VectorXd f = enumerated(A, b);
    const LcpSolution s = solve_lcp(A, b);
    ASSERT_LT((s.f - f).norm(), 1e-9 * (1 + f.norm())) << n;
    ASSERT_FALSE(s.fell_back);
  }
}

// b is in the range of A, as it is for contacts: the problem is solvable for any rank, and a is unique even
// where f is not.
TEST(Lcp, ProblemsOfEveryRankAreSolved) {
  Dice dice(2);
  for (int trial = 0; trial < 2000; ++trial) {
    const Index n = 2 + trial % 30, rank = 1 + dice.index(static_cast<std::size_t>(n));
    const MatrixXd J = random_lcp_matrix(dice, n, rank);
    const MatrixXd A = J * J.transpose();
    const VectorXd b = J * random_lcp_matrix(dice, rank, 1);
    expect_solves(solve_lcp(A, b), A, b, 1e-9);
  }
}

// Whole numbers cause many ties, hence steps of length zero, at which a pivoting method could cycle.
TEST(Lcp, DegenerateProblemsAreSolved) {
  Dice dice(3);
  for (int trial = 0; trial < 2000; ++trial) {
    const Index n = 2 + trial % 20, rank = 1 + dice.index(static_cast<std::size_t>(n));
    const MatrixXd J = (1.5 * random_lcp_matrix(dice, n, rank)).array().round();
    const MatrixXd A = J * J.transpose();
    const VectorXd b = J * MatrixXd((1.5 * random_lcp_matrix(dice, rank, 1)).array().round());
    if (b.isZero()) continue;
    expect_solves(solve_lcp(A, b), A, b, 1e-9);
  }
}

TEST(Lcp, FiveHundredContactsHaveNoResidual) {
  Dice dice(4);
  const MatrixXd J = random_lcp_matrix(dice, 500, 300);
  const MatrixXd A = J * J.transpose();
  const VectorXd b = J * random_lcp_matrix(dice, 300, 1);
  const LcpSolution s = solve_lcp(A, b);
  expect_solves(s, A, b, 1e-9);
  EXPECT_LT(s.residual, 1e-10 * b.cwiseAbs().maxCoeff());
  EXPECT_LT(s.pivots, 2000u);
}

/// Unit boxes on each other with `points` contacts per layer. All normals point up, and b comes from gravity.
struct Stack {
  MatrixXd A;
  VectorXd b;

  Stack(int boxes, const std::vector<Vec3>& points, Real mass, Real inertia) {
    const auto per = static_cast<Index>(points.size()), n = boxes * per;
    MatrixXd J = MatrixXd::Zero(n, 3 * boxes);  // for each box: vertical motion, and rotation about x and z
    for (Index i = 0; i < n; ++i) {
      const Vec3& r = points[static_cast<std::size_t>(i % per)];
      const Index above = i / per;
      J.block<1, 3>(i, 3 * above) << 1, -r.z(), r.x();
      if (above > 0) J.block<1, 3>(i, 3 * (above - 1)) << -1, r.z(), -r.x();
    }
    VectorXd inverse(3 * boxes), acceleration = VectorXd::Zero(3 * boxes);
    for (Index k = 0; k < boxes; ++k) {
      inverse.segment<3>(3 * k) << 1 / mass, 1 / inertia, 1 / inertia;
      acceleration[3 * k] = -9.81;
    }
    A = J * inverse.asDiagonal() * J.transpose();
    b = J * acceleration;
  }
};

std::vector<Vec3> square_grid(int side) {
  std::vector<Vec3> points;
  for (int i = 0; i < side; ++i)
    for (int k = 0; k < side; ++k) points.emplace_back(i / (side - 1.0) - 0.5, 0, k / (side - 1.0) - 0.5);
  return points;
}

TEST(Lcp, RedundantContactsCarryTheWholeWeight) {
  for (const int side : {2, 3, 5}) {
    const Stack box(1, square_grid(side), 3, 0.5);
    const LcpSolution s = solve_lcp(box.A, box.b);
    expect_solves(s, box.A, box.b, 1e-12);
    EXPECT_NEAR(s.f.sum(), 3 * 9.81, 1e-12);
  }
}

TEST(Lcp, TenBoxesCarryTheBoxesAboveThem) {
  const Stack stack(10, square_grid(2), 2, 1.0 / 3);
  const LcpSolution s = solve_lcp(stack.A, stack.b);
  expect_solves(s, stack.A, stack.b, 1e-12);
  for (Index k = 0; k < 10; ++k)
    EXPECT_NEAR(s.f.segment<4>(4 * k).sum(), static_cast<Real>(10 - k) * 2 * 9.81, 1e-10);
}

// Two opposite walls that both approach: a force from one requires an equal one from the other, which changes
// nothing.
TEST(Lcp, ImpossibleProblemReportsTheIndex) {
  MatrixXd A(3, 3);
  A << 1, -1, 0, -1, 1, 0, 0, 0, 2;
  const LcpSolution s = solve_lcp(A, VectorXd{{-1, -1, -4}});
  EXPECT_EQ(s.unbounded, std::vector<uint32_t>{1});
  EXPECT_NEAR(s.f[2], 2, 1e-14);
  EXPECT_TRUE(s.f.allFinite());
  EXPECT_LT(s.pivots, 20u);
}

TEST(Lcp, NothingToSolve) {
  EXPECT_EQ(solve_lcp(MatrixXd(0, 0), VectorXd(0)).pivots, 0u);
  EXPECT_TRUE(solve_lcp(MatrixXd::Zero(2, 2), VectorXd::Zero(2)).f.isZero());
}

}  // namespace
}  // namespace offstage::sim
