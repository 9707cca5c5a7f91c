#include "sim/articulation/joint_system.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/convex_samples.h"

namespace offstage::sim {
namespace {

constexpr uint32_t kDriven = JointSystem::kDriven;
using Topology = JointSystem::Topology;

/// Returns a matrix close to the identity, whose columns are about as independent as the rows of real joints.
Mat6 random_columns(Dice& dice, uint32_t count) {
  Mat6 m = Mat6::Zero();
  for (Eigen::Index j = 0; j < count; ++j)
    for (Eigen::Index i = 0; i < 6; ++i) m(i, j) = (i == j) + dice.uniform(-0.25, 0.25);
  return m;
}

std::vector<JointRows> random_rows(Dice& dice, const std::vector<Topology>& joints) {
  std::vector<JointRows> rows;
  for (const Topology& j : joints) {
    JointRows r;
    r.count = j.rows;
    if (j.a != kDriven) r.on_a = random_columns(dice, j.rows);
    if (j.b != kDriven) r.on_b = random_columns(dice, j.rows);
    rows.push_back(r);
  }
  return rows;
}

/// Returns random links whose masses span three decades.
std::vector<LinkMobility> random_links(Dice& dice, uint32_t count) {
  std::vector<LinkMobility> links;
  for (uint32_t i = 0; i < count; ++i) {
    const Mat3 m = random_columns(dice, 3).topLeftCorner<3, 3>();
    const Real scale = std::pow(10, dice.uniform(-1.5, 1.5));
    links.push_back({scale, scale * (m * m.transpose() + 0.1 * Mat3::Identity())});
  }
  return links;
}

/// Checks that correct() makes the requested change, and that it equals the effect of the returned impulses.
void expect_solves(uint32_t links, const std::vector<Topology>& joints, uint64_t seed, Real tolerance) {
  Dice dice(seed);
  JointSystem system(links, joints);
  const auto rows = random_rows(dice, joints);
  const auto mobility = random_links(dice, links);
  ASSERT_TRUE(system.factorize(rows, mobility));
  // The requested change is the violation of some random velocities, so loops of redundant constraints can
  // satisfy it.
  std::vector<Vec6> wanted(links), change(joints.size()), impulses(joints.size()), result(joints.size());
  for (Vec6& v : wanted) v = random_columns(dice, 1).col(0);
  system.relative(wanted, change);
  std::vector<Vec6> velocities(links, Vec6::Zero()), by_impulses(links, Vec6::Zero());
  system.correct(change, impulses, velocities);
  system.relative(velocities, result);
  Real scale = 0;
  for (const Vec6& c : change) scale = std::max(scale, c.norm());
  for (std::size_t j = 0; j < joints.size(); ++j)
    EXPECT_LT((result[j] - change[j]).norm(), tolerance * scale);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const Topology& t = joints[j];
    if (t.a != kDriven) by_impulses[t.a] += mobility[t.a].velocity(rows[j].on_a * impulses[j]);
    if (t.b != kDriven) by_impulses[t.b] += mobility[t.b].velocity(rows[j].on_b * impulses[j]);
  }
  for (uint32_t i = 0; i < links; ++i)
    EXPECT_LT((by_impulses[i] - velocities[i]).norm(), 1e-9 * (1 + velocities[i].norm()));
}

TEST(JointSystem, SolvesTreesOfAllKinds) {
  Dice dice(1);
  for (uint64_t round = 0; round < 60; ++round) {
    const uint32_t links = 1 + dice.index(30);
    std::vector<Topology> joints;
    if (round % 2 == 0) joints.push_back({0, kDriven, 1 + dice.index(6)});
    // Every third round takes parents from the first two links only, which makes hubs with many joints.
    for (uint32_t i = 1; i < links; ++i) {
      const uint32_t parent = round % 3 == 0 ? dice.index(std::min(i, 2u)) : dice.index(i);
      const uint32_t rows = round % 5 == 0 ? 3 : 1 + dice.index(6);
      joints.push_back(dice.index(2) ? Topology{i, parent, rows} : Topology{parent, i, rows});
    }
    const JointSystem system(links, joints);
    EXPECT_FALSE(system.has_loops());
    expect_solves(links, joints, round, 1e-7);
  }
}

TEST(JointSystem, SolvesLoopsWithRowsThatDependOnEachOther) {
  // Ladders have as many constraints as degrees of freedom, or more.
  for (const uint32_t n : {2u, 5u, 12u}) {
    std::vector<Topology> joints = {{0, kDriven, 3}, {n, kDriven, 3}};
    for (uint32_t i = 0; i + 1 < n; ++i) {
      joints.push_back({i, i + 1, 3});
      joints.push_back({n + i, n + i + 1, 3});
    }
    for (uint32_t i = 0; i < n; ++i) joints.push_back({i, n + i, 5});
    ASSERT_TRUE(JointSystem(2 * n, joints).has_loops());
    expect_solves(2 * n, joints, n, 1e-6);
  }
}

TEST(JointSystem, TheCostOfAStarIsLinearInItsJoints) {
  // Eliminating the shared link first would couple all its joints: 1000 joints would give a dense matrix of
  // 3000 rows.
  constexpr uint32_t kLinks = 1001;
  std::vector<Topology> joints;
  for (uint32_t i = 1; i < kLinks; ++i) joints.push_back({i, 0, 3});
  expect_solves(kLinks, joints, 9, 1e-7);
}

}  // namespace
}  // namespace offstage::sim
