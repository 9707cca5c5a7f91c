#include "sim/cloth/cloth_tree.h"

#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include <gtest/gtest.h>

namespace offstage::sim {
namespace {

using Pairs = std::multiset<std::pair<uint32_t, uint32_t>>;

Pairs found_by(const ClothTree& tree, std::span<const Vec4> points) {
  Pairs pairs;
  tree.pairs(points, [&](uint32_t a, uint32_t b) { pairs.insert(std::minmax(a, b)); });
  return pairs;
}

/// Separate triangles on short paths, so that no surface excludes pairs.
struct Swarm {
  explicit Swarm(uint32_t count) {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<Real> place(-1, 1), size(-0.1, 0.1);
    const auto any = [&](auto& of) { return Vec4(of(random), of(random), of(random), 0); };
    for (uint32_t t = 0; t < count; ++t) {
      triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
      const Vec4 centre = any(place), way = 3 * any(size);
      for (int k = 0; k < 3; ++k) {
        from.push_back(centre + any(size));
        to.push_back(from.back() + way + 0.3 * any(size));
      }
    }
    margin.assign(from.size(), 0.01);
    tree.build(triangles, from);
  }
  /// Returns whether along some axis one triangle is above the other at the start and at the end.
  bool apart(uint32_t a, uint32_t b) const {
    const auto above = [&](const Triangle& p, const Triangle& q, int axis, const std::vector<Vec4>& x) {
      Real least = 1e9, greatest = -1e9;
      for (uint32_t i : p) least = std::min(least, x[i][axis] - margin[i]);
      for (uint32_t i : q) greatest = std::max(greatest, x[i][axis] + margin[i]);
      return least - greatest;
    };
    for (int axis = 0; axis < 3; ++axis)
      for (auto [p, q] : {std::pair(a, b), std::pair(b, a)})
        if (above(triangles[p], triangles[q], axis, from) > 0 &&
            above(triangles[p], triangles[q], axis, to) > 0)
          return true;
    return false;
  }
  Pairs meeting(const std::set<uint32_t>& fresh) const {
    Pairs pairs;
    for (uint32_t a = 0; a < triangles.size(); ++a)
      for (uint32_t b = a + 1; b < triangles.size(); ++b)
        if ((fresh.contains(a) || fresh.contains(b)) && !apart(a, b)) pairs.emplace(a, b);
    return pairs;
  }
  Pairs found() const { return found_by(tree, from); }

  std::vector<Triangle> triangles;
  std::vector<Vec4> from, to;
  std::vector<Real> margin;
  ClothTree tree;
};

TEST(ClothTree, FindsAllPairsOfBoxesThatMeetOnTheirWays) {
  Swarm swarm(500);
  swarm.tree.fit(swarm.from, swarm.to, swarm.margin);
  std::set<uint32_t> all;
  for (uint32_t t = 0; t < swarm.triangles.size(); ++t) all.insert(t);
  const Pairs expected = swarm.meeting(all);
  EXPECT_GT(expected.size(), 500u);
  EXPECT_EQ(swarm.found(), expected);
}

TEST(ClothTree, FindsThePairsOfThoseFittedAgainAlone) {
  Swarm swarm(300);
  swarm.tree.fit(swarm.from, swarm.to, swarm.margin);
  const std::vector<uint32_t> again = {0, 17, 18, 19, 140, 299};
  for (uint32_t t : again)
    for (uint32_t i : swarm.triangles[t]) swarm.to[i] = swarm.from[i] + Vec4(0.4, -0.3, 0.2, 0);
  swarm.tree.refit(again, swarm.from, swarm.to, swarm.margin);
  const Pairs expected = swarm.meeting({again.begin(), again.end()});
  EXPECT_GT(expected.size(), 10u);
  EXPECT_EQ(swarm.found(), expected);
}

/// A strip of 60 triangles of 0.1 m, bent by an angle from one row of edges to the next.
struct Strip {
  explicit Strip(Real angle) {
    Vec4 at = Vec4::Zero();
    for (int row = 0; row <= 30; ++row) {
      for (Real z : {0.0, 0.1}) points.push_back(at + Vec4(0, 0, z, 0));
      at += 0.1 * Vec4(std::cos(row * angle), std::sin(row * angle), 0, 0);
    }
    for (uint32_t k = 0; k < 60; k += 2) {
      triangles.push_back({k, k + 1, k + 2});
      triangles.push_back({k + 1, k + 3, k + 2});
    }
    for (std::size_t i = 0; i < points.size(); ++i)
      rest.emplace_back(0.1 * static_cast<Real>(i / 2), 0, 0.1 * static_cast<Real>(i % 2), 0);
    tree.build(triangles, rest);
    tree.fit(points, points, std::vector<Real>(points.size(), 0.005));
  }
  Pairs found() const { return found_by(tree, points); }

  std::vector<Triangle> triangles;
  std::vector<Vec4> points, rest;
  ClothTree tree;
};

TEST(ClothTree, SkipsNearlyFlatPatches) {
  EXPECT_TRUE(Strip(0).found().empty());
  EXPECT_TRUE(Strip(0.02).found().empty());
}

// A roll of a bit more than a turn: its end lies on its beginning, while neighbours lean to one side.
TEST(ClothTree, FindsTheEndsOfARollButNotItsNeighbours) {
  const Pairs pairs = Strip(2 * std::numbers::pi / 29).found();
  EXPECT_TRUE(pairs.contains({0, 58}) || pairs.contains({0, 59}));
  for (const auto& [a, b] : pairs) EXPECT_GT(b - a, 2u) << a << ' ' << b;
}

// Folded like paper: neighbours face each other.
TEST(ClothTree, FindsNeighboursInASharpFold) {
  const Pairs pairs = Strip(0.9 * std::numbers::pi).found();
  EXPECT_TRUE(pairs.contains({1, 2}));
  EXPECT_TRUE(pairs.contains({0, 4}));
}

}  // namespace
}  // namespace offstage::sim
