#include "sim/linear/block_cholesky.h"

#include <algorithm>
#include <vector>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "tests/convex_samples.h"

namespace offstage::sim {
namespace {

using Pairs = std::vector<std::pair<uint32_t, uint32_t>>;

struct Matrix {
  std::vector<Mat6> diagonal, off;
  Eigen::MatrixXd dense;
};

Mat6 random_block(Dice& dice) {
  Mat6 m;
  for (Eigen::Index i = 0; i < 36; ++i) m.data()[i] = dice.uniform(-1, 1);
  return m;
}

/// Returns a matrix like that of a contact problem: a mass on the diagonal for each row, and for each pair a
/// stiff B^T B coupling both of its rows.
Matrix random_matrix(Dice& dice, uint32_t rows, const Pairs& pairs, Real stiffness) {
  Matrix m{std::vector<Mat6>(rows, Mat6::Identity()), {}, Eigen::MatrixXd::Identity(6 * rows, 6 * rows)};
  for (const auto& [i, j] : pairs) {
    const Mat6 a = random_block(dice), b = random_block(dice);
    m.diagonal[i] += stiffness * a.transpose() * a;
    m.diagonal[j] += stiffness * b.transpose() * b;
    m.off.push_back(stiffness * a.transpose() * b);
  }
  for (uint32_t i = 0; i < rows; ++i) m.dense.block<6, 6>(6 * i, 6 * i) = m.diagonal[i];
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto& [i, j] = pairs[k];
    m.dense.block<6, 6>(6 * i, 6 * j) = m.off[k];
    m.dense.block<6, 6>(6 * j, 6 * i) = m.off[k].transpose();
  }
  return m;
}

Pairs random_pairs(Dice& dice, uint32_t rows, uint32_t count) {
  Pairs pairs;
  for (uint32_t k = 0; k < count; ++k) {
    const uint32_t i = dice.index(rows), j = dice.index(rows);
    if (i != j) pairs.emplace_back(std::min(i, j), std::max(i, j));
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

TEST(BlockCholesky, AgreesWithTheDenseFactorization) {
  Dice dice(1);
  BlockCholesky<6> cholesky;  // the object is reused, so one pattern follows another
  for (int round = 0; round < 120; ++round) {
    const uint32_t rows = 1 + dice.index(20);
    const Pairs pairs = random_pairs(dice, rows, dice.index(4 * rows));
    cholesky.analyze(rows, pairs);
    EXPECT_EQ(cholesky.rows(), rows);
    for (int values = 0; values < 2; ++values) {
      const Matrix m = random_matrix(dice, rows, pairs, dice.chance(0.5) ? 1 : 1e3);
      ASSERT_TRUE(cholesky.factorize(m.diagonal, m.off));
      std::vector<Vec6> x(rows);
      Eigen::VectorXd b(6 * rows);
      for (uint32_t i = 0; i < rows; ++i) {
        for (Eigen::Index k = 0; k < 6; ++k) x[i][k] = dice.uniform(-1, 1);
        b.segment<6>(6 * i) = x[i];
      }
      cholesky.solve(x);
      const Eigen::VectorXd expected = m.dense.llt().solve(b);
      for (uint32_t i = 0; i < rows; ++i)
        ASSERT_LT((x[i] - expected.segment<6>(6 * i)).norm(), 1e-9 * (1 + expected.norm()));
    }
  }
}

TEST(BlockCholesky, ReportsMatricesThatAreNotPositiveDefinite) {
  Dice dice(2);
  const Pairs pairs = {{0, 1}, {1, 2}};
  Matrix m = random_matrix(dice, 3, pairs, 1);
  BlockCholesky<6> cholesky;
  cholesky.analyze(3, pairs);
  ASSERT_TRUE(cholesky.factorize(m.diagonal, m.off));
  m.diagonal[1] -= 100 * Mat6::Identity();
  EXPECT_FALSE(cholesky.factorize(m.diagonal, m.off));
}

// A stack has no fill-in in any numbering: one off-diagonal block per row. A wall of n x n bodies has far
// less than a band matrix of width n.
TEST(BlockCholesky, ReordersForLittleFillIn) {
  constexpr uint32_t kRows = 400, kWide = 20;
  std::vector<uint32_t> name(kRows);
  for (uint32_t i = 0; i < kRows; ++i) name[i] = i * 157 % kRows;
  const auto pair = [&](uint32_t i, uint32_t j) {
    return std::pair(std::min(name[i], name[j]), std::max(name[i], name[j]));
  };
  Pairs stack, wall;
  for (uint32_t i = 0; i + 1 < kRows; ++i) stack.push_back(pair(i, i + 1));
  for (uint32_t i = 0; i < kRows; ++i) {
    if (i % kWide + 1 < kWide) wall.push_back(pair(i, i + 1));
    if (i + kWide < kRows) wall.push_back(pair(i, i + kWide));
  }
  std::sort(stack.begin(), stack.end());
  std::sort(wall.begin(), wall.end());
  BlockCholesky<6> cholesky;
  cholesky.analyze(kRows, stack);
  EXPECT_EQ(cholesky.factor_blocks(), 2 * kRows - 1);
  cholesky.analyze(kRows, wall);
  EXPECT_LT(cholesky.factor_blocks(), kRows * kWide / 2);
}

TEST(BlockCholesky, SolvesQuasiDefiniteMatricesInAnyOrder) {
  Dice dice(7);
  for (int round = 0; round < 40; ++round) {
    // Rows of bodies, and rows of joints that connect two of them and have a zero diagonal block.
    const uint32_t bodies = 2 + dice.index(12), joints = 1 + dice.index(bodies - 1);
    std::vector<Mat6> diagonal, off;
    std::vector<BlockRowKind> kinds(joints, {.is_negative = true, .is_empty = true});
    kinds.resize(joints + bodies);
    Pairs pairs;
    for (uint32_t j = 0; j < joints; ++j) {
      diagonal.push_back(Mat6::Zero());
      pairs.emplace_back(j, joints + j);
      pairs.emplace_back(j, joints + j + 1);
    }
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(6 * kinds.size(), 6 * kinds.size());
    for (uint32_t i = 0; i < bodies; ++i) {
      const Mat6 m = random_block(dice);
      diagonal.push_back(m * m.transpose() + 0.1 * Mat6::Identity());
      dense.block<6, 6>(6 * (joints + i), 6 * (joints + i)) = diagonal.back();
    }
    for (const auto& [i, j] : pairs) {
      // As in joints, the block is invertible: each body can move along every constraint.
      off.push_back(Mat6::Identity() + 0.2 * random_block(dice));
      dense.block<6, 6>(6 * i, 6 * j) = off.back();
      dense.block<6, 6>(6 * j, 6 * i) = off.back().transpose();
    }
    BlockCholesky<6> cholesky;
    cholesky.analyze(static_cast<uint32_t>(kinds.size()), pairs, kinds);
    ASSERT_TRUE(cholesky.factorize(diagonal, off));
    std::vector<Vec6> x(kinds.size());
    Eigen::VectorXd b(dense.rows());
    for (std::size_t i = 0; i < x.size(); ++i) b.segment<6>(6 * i) = x[i] = random_block(dice).col(0);
    cholesky.solve(x);
    Eigen::VectorXd found(b.size());
    for (std::size_t i = 0; i < x.size(); ++i) found.segment<6>(6 * i) = x[i];
    EXPECT_LT((dense * found - b).norm(), 1e-10 * b.norm() * (1 + found.norm()));
  }
}

}  // namespace
}  // namespace offstage::sim
