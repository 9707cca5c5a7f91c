/// Paths of springs: every spring lies in one, consecutive springs share a point and go on straight, and
/// paths of one colour share no point.

#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "sim/cloth/spring_paths.h"

namespace offstage::sim {
namespace {

ClothPoints rest_points(const ClothDef& def) {
  ClothPoints points;
  for (const Vec3& p : def.vertices) {
    points.rest.push_back(padded(p));
    points.position.push_back(padded(p));
  }
  return points;
}

void expect_paths(std::span<const ClothSpring> springs, std::span<const SpringPath> paths) {
  std::vector<int> taken(springs.size(), 0);
  for (const SpringPath& path : paths) {
    ASSERT_EQ(path.points.size(), path.springs.size() + 1);
    for (std::size_t i = 0; i < path.springs.size(); ++i) {
      const ClothSpring& s = springs[path.springs[i]];
      ++taken[path.springs[i]];
      EXPECT_EQ(std::minmax(s.a, s.b), std::minmax(path.points[i], path.points[i + 1]));
      EXPECT_EQ(s.kind, springs[path.springs[0]].kind);
    }
  }
  EXPECT_EQ(std::ranges::count(taken, 1), static_cast<std::ptrdiff_t>(springs.size()));
}

void expect_colors(std::span<const SpringPath> paths, std::size_t point_count) {
  const std::vector<uint32_t> color = path_colors(paths, point_count);
  for (uint32_t c = 0; c + 1 < kPathColors; ++c) {
    std::set<uint32_t> points;
    std::size_t count = 0;
    for (std::size_t i = 0; i < paths.size(); ++i) {
      if (color[i] != c) continue;
      const std::set<uint32_t> own(paths[i].points.begin(), paths[i].points.end());
      points.insert(own.begin(), own.end());
      count += own.size();
    }
    EXPECT_EQ(points.size(), count) << c;
  }
}

TEST(SpringPaths, OfAWeaveAreItsThreadsAndDiagonals) {
  const ClothDef def = effects::grid_cloth({2, 1, 8, 5}, {}, effects::find_fabric("cotton")->fabric);
  const ClothPoints points = rest_points(def);
  const std::vector<SpringPath> paths = spring_paths(def.springs, points);
  expect_paths(def.springs, paths);
  expect_colors(paths, points.size());
  // 9 + 6 threads, and two families of 8 + 5 - 1 diagonals.
  EXPECT_EQ(paths.size(), 9u + 6 + 2 * (8 + 5 - 1));
  const std::vector<uint32_t> color = path_colors(paths, points.size());
  EXPECT_EQ(std::ranges::max(color), 3u);
}

TEST(SpringPaths, OfARingAreCutOpen) {
  constexpr uint32_t kCount = 24;
  ClothPoints points;
  std::vector<ClothSpring> springs;
  for (uint32_t i = 0; i < kCount; ++i) {
    const Real angle = 2 * 3.14159265358979 * i / kCount;
    points.position.push_back({std::cos(angle), std::sin(angle), 0, 0});
    springs.push_back({.a = i, .b = (i + 1) % kCount});
  }
  points.rest = points.position;
  const std::vector<SpringPath> paths = spring_paths(springs, points);
  expect_paths(springs, paths);
  ASSERT_EQ(paths.size(), 1u);
  EXPECT_EQ(paths[0].points.front(), paths[0].points.back());
}

TEST(SpringPaths, AtAPointWithMoreSpringsThanColoursAllAreTaken) {
  constexpr uint32_t kCount = 100;
  ClothPoints points;
  points.position.push_back(Vec4::Zero());
  std::vector<ClothSpring> springs;
  for (uint32_t i = 0; i < kCount; ++i) {
    const Real angle = 3.14159265358979 / 2 * i / kCount;  // no two springs are on one line
    points.position.push_back({std::cos(angle), std::sin(angle), 0, 0});
    springs.push_back({.a = 0, .b = i + 1});
  }
  points.rest = points.position;
  const std::vector<SpringPath> paths = spring_paths(springs, points);
  expect_paths(springs, paths);
  expect_colors(paths, points.size());
  const std::vector<uint32_t> color = path_colors(paths, points.size());
  EXPECT_EQ(std::ranges::count(color, kPathColors - 1),
            static_cast<std::ptrdiff_t>(kCount - (kPathColors - 1)));
}

}  // namespace
}  // namespace offstage::sim
