#include "sim/collision/bounding_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <set>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/meshes.h"
#include "tests/random.h"

namespace offstage::sim {
namespace {

constexpr std::array kSplits = {TreeSplit::mean, TreeSplit::surface_area};

std::vector<Aabb> random_boxes(std::size_t n, bool clustered) {
  const Scatter random{3};
  std::vector<Aabb> boxes;
  for (uint64_t i = 0; i < n; ++i) {
    Vec3 p, s;
    for (uint32_t k = 0; k < 3; ++k) {
      p[k] = random.uniform(i, k);
      // nearly all boxes lie at one corner, so a split at the mean separates almost nothing
      if (clustered) p[k] = std::pow(p[k], 20);
      s[k] = 0.05 * random.uniform(i, 3 + k);
    }
    boxes.emplace_back(p, p + s);
  }
  return boxes;
}

/// Returns a torus with flat, straight and coincident triangles added.
TriangleMesh rough_mesh() {
  TriangleMesh mesh = torus_mesh(1, 0.4, 16, 8);
  const Scatter random{7};
  for (uint64_t i = 0; i < mesh.vertices.size(); ++i)
    mesh.vertices[i] += 0.05 * Vec3(random.uniform(i, 0), random.uniform(i, 1), random.uniform(i, 2));
  const auto v = static_cast<uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {{2, 0, 0}, {3, 0, 0}, {4, 0, 0}, {2, 1, 0}});
  mesh.triangles.insert(mesh.triangles.end(), {{v, v, v}, {v, v + 1, v + 2}, {v, v + 1, v + 3}});
  for (int i = 0; i < 20; ++i) mesh.triangles.push_back({v, v + 2, v + 3});
  return mesh;
}

Real outside(const Aabb& v, const Vec3& p) {
  return v.exteriorDistance(p);
}
Real outside(const Obb& v, const Vec3& p) {
  return ((v.axes.transpose() * (p - v.centre)).cwiseAbs() - v.half).maxCoeff();
}
Real outside(const BoundingSphere& v, const Vec3& p) {
  return (p - v.centre).norm() - v.radius;
}

template <class Volume>
void expect_holds_its_triangles(const BoundingTree<Volume>& tree, const TriangleMesh& mesh) {
  std::vector<int> times(mesh.triangles.size());
  for (const auto& node : tree.nodes()) {
    ASSERT_GE(node.count, 1u);
    ASSERT_EQ(node.is_leaf(), node.size == 1);
    if (!node.is_leaf()) {
      ASSERT_EQ(tree.first_child(node).count + tree.second_child(node).count, node.count);
    }
    for (uint32_t item : tree.items(node)) {
      times[item] += node.is_leaf();
      for (uint32_t v : mesh.triangles[item]) ASSERT_LT(outside(node.volume, mesh.vertices[v]), 1e-14);
    }
  }
  for (int t : times) ASSERT_EQ(t, 1);
}

template <class Volume>
class BoundingTreeOf : public testing::Test {};
using Volumes = testing::Types<Aabb, Obb, BoundingSphere>;
TYPED_TEST_SUITE(BoundingTreeOf, Volumes);

TYPED_TEST(BoundingTreeOf, NodesHoldTheirTrianglesAndLeavesPartThem) {
  const TriangleMesh mesh = rough_mesh();
  for (TreeSplit split : kSplits) {
    const BoundingTree<TypeParam> tree(mesh, split);
    expect_holds_its_triangles(tree, mesh);
    for (const auto& node : tree.nodes()) {
      if (!node.is_leaf() || node.count == 1) continue;
      for (uint32_t item : tree.items(node))
        EXPECT_GE(item, mesh.triangles.size() - 20) << "only coincident triangles share a leaf";
    }
  }
}

TYPED_TEST(BoundingTreeOf, RefitFollowsADeformation) {
  TriangleMesh mesh = rough_mesh();
  BoundingTree<TypeParam> tree(mesh);
  for (Vec3& v : mesh.vertices) v = Vec3(v.x() + v.y() * v.y(), 2 * v.y() - v.z(), std::sin(3 * v.x())) * 5;
  tree.refit(mesh);
  expect_holds_its_triangles(tree, mesh);
}

TYPED_TEST(BoundingTreeOf, IsTheSameForAnyNumberOfThreads) {
  const TriangleMesh mesh = torus_mesh(1, 0.4, 150, 100);
  for (TreeSplit split : kSplits) {
    const auto build = [&](std::size_t threads) {
      const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
      return BoundingTree<TypeParam>(mesh, split);
    };
    const auto one = build(1), many = build(4);
    ASSERT_EQ(one.nodes().size(), many.nodes().size());
    ASSERT_TRUE(std::equal(one.items().begin(), one.items().end(), many.items().begin()));
    for (std::size_t i = 0; i < one.nodes().size(); ++i) {
      const auto &a = one.nodes()[i], &b = many.nodes()[i];
      ASSERT_TRUE(a.size == b.size && a.first == b.first && a.count == b.count);
      ASSERT_EQ(std::memcmp(&a.volume, &b.volume, sizeof(TypeParam)), 0);
    }
  }
}

TYPED_TEST(BoundingTreeOf, DepthIsBoundedForHostileInput) {
  // Two hostile meshes: coincident triangles; and triangles each ten times nearer to a corner than the one
  // before, so that every split at a mean or at a bin border separates only one of them.
  TriangleMesh same, crowded;
  same.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  same.triangles.assign(50'000, {0, 1, 2});
  for (uint32_t i = 0; i < 300; ++i) {
    const Real x = std::pow(10.0, -static_cast<Real>(i));
    crowded.vertices.insert(crowded.vertices.end(), {{x, 0, 0}, {x, x, 0}, {x, 0, x}});
    crowded.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  for (TreeSplit split : kSplits)
    for (const TriangleMesh* mesh : {&same, &crowded}) {
      uint32_t deepest = 0, nodes = 0, leaves = 0;
      BoundingTree<TypeParam>(*mesh, split).for_each_node([&](uint32_t level, const TypeParam&, bool leaf) {
        deepest = std::max(deepest, level);
        ++nodes;
        leaves += leaf;
      });
      EXPECT_LE(deepest, kMaxTreeDepth);
      EXPECT_EQ(nodes, 2 * leaves - 1);
      EXPECT_EQ(leaves, mesh == &same ? 1u : 300u);
    }
}

TYPED_TEST(BoundingTreeOf, NothingHasNothing) {
  const BoundingTree<TypeParam> tree{TriangleMesh()};
  EXPECT_TRUE(tree.empty());
  EXPECT_EQ(tree.reach(), 0);
  tree.for_each_node([](uint32_t, const TypeParam&, bool) { FAIL(); });
}

TEST(AabbTree, FindsExactlyWhatBruteForceFinds) {
  for (TreeSplit split : kSplits)
    for (bool clustered : {false, true}) {
      const auto boxes = random_boxes(1000, clustered);
      const AabbTree tree(boxes, split);
      for (const Aabb& query : random_boxes(200, clustered)) {
        std::set<uint32_t> brute, found;
        for (uint32_t i = 0; i < boxes.size(); ++i)
          if (boxes[i].intersects(query)) brute.insert(i);
        tree.overlapping(query, [&](uint32_t i) { EXPECT_TRUE(found.insert(i).second) << "twice"; });
        ASSERT_EQ(found, brute);
      }
    }
}

TEST(AabbTree, NearestIsTheNearestAndFewAreVisited) {
  const auto boxes = random_boxes(4000, false);
  const AabbTree tree(boxes);
  for (const Aabb& query : random_boxes(100, false)) {
    const Vec3 p = query.center() * 1.2;
    Real brute = 1e30, best = 1e30;
    for (const Aabb& b : boxes) brute = std::min(brute, b.squaredExteriorDistance(p));
    int visits = 0;
    tree.nearest(p, [&](uint32_t i) {
      ++visits;
      best = std::min(best, boxes[i].squaredExteriorDistance(p));
      return boxes[i].squaredExteriorDistance(p);
    });
    ASSERT_EQ(best, brute);
    ASSERT_LT(visits, 200);
  }
}

TEST(AabbTree, CoincidentItemsShareALeafAndEmptyTreesHaveNothing) {
  const std::vector<Aabb> same(100, Aabb(Vec3::Zero(), Vec3::Ones()));
  int count = 0;
  AabbTree(same).overlapping(Aabb(Vec3::Zero(), Vec3::Zero()), [&](uint32_t) { ++count; });
  EXPECT_EQ(count, 100);
  const AabbTree empty;
  empty.overlapping(same[0], [](uint32_t) { FAIL(); });
  EXPECT_TRUE(empty.bounds().isEmpty());
}

/// Returns the corners of a box that is rotated and away from the origin.
std::vector<Vec3> turned_box(const Vec3& size, const Quat& q) {
  std::vector<Vec3> points;
  for (const Vec3& v : box_mesh(size).vertices) points.push_back(q * v + Vec3(5, -3, 2));
  return points;
}

TEST(ObbFit, IsTheBoxOfABoxWithAnyPointsInside) {
  const Quat q(0.9, 0.2, -0.3, 0.25);
  const Vec3 size(3, 2, 1);
  std::vector<Vec3> points = turned_box(size, q.normalized());
  // Many points in one corner, which would tilt the principal axes of a covariance fit.
  const Scatter random{5};
  for (uint64_t i = 0; i < 1000; ++i) {
    const Vec3 p(random.uniform(i, 0), random.uniform(i, 1), random.uniform(i, 2));
    points.push_back(q.normalized() * (Vec3(0.5, 0, 0) + 0.45 * p) + Vec3(5, -3, 2));
  }
  for (const std::size_t count : {std::size_t{8}, std::size_t{20}, points.size()}) {
    const Obb box = fit_obb(std::span(points).first(count));
    std::array<Real, 3> sides = {2 * box.half[0], 2 * box.half[1], 2 * box.half[2]};
    std::sort(sides.begin(), sides.end());
    EXPECT_NEAR(sides[0], 1, 1e-9) << count;
    EXPECT_NEAR(sides[1], 2, 1e-9) << count;
    EXPECT_NEAR(sides[2], 3, 1e-9) << count;
  }
}

TEST(ObbFit, IsThinAroundFlatStraightAndSinglePoints) {
  const Scatter random{6};
  const Mat3 axes = Quat(0.3, 0.5, -0.7, 0.2).normalized().toRotationMatrix();
  for (int dimension = 0; dimension < 3; ++dimension)
    for (std::size_t count : {1u, 2u, 3u, 4u, 6u, 24u, 25u, 500u}) {
      std::vector<Vec3> points;
      for (uint64_t i = 0; i < count; ++i) {
        Vec3 p = Vec3::Zero();
        for (int k = 0; k < dimension; ++k) p[k] = random.uniform(i, static_cast<uint64_t>(k)) * (1 + k);
        points.push_back(axes * p + Vec3(1, 2, 3));
      }
      const Obb box = fit_obb(points);
      ASSERT_TRUE(box.axes.isUnitary(1e-14));
      ASSERT_GT(box.axes.determinant(), 0);
      EXPECT_LE((box.half.array() > 1e-14).count(), dimension) << dimension << " of " << count;
    }
}

TEST(ObbFit, OfThreePointsIsTheSmallestRectangle) {
  const Obb box = fit_obb(std::array{Vec3(0, 0, 0), Vec3(5, 0, 0), Vec3(1, 2, 0)});
  EXPECT_NEAR(4 * box.half.head<2>().prod(), 10, 1e-12) << "twice the area";
  EXPECT_NEAR(box.half[2], 0, 1e-15);
}

TEST(SphereFit, HoldsAllPointsAndIsNearlyMinimal) {
  const Scatter random{8};
  for (uint64_t i = 0; i < 500; ++i) {
    std::vector<Vec3> points;
    for (uint64_t k = 0; k < 2 + i % 40; ++k)
      points.emplace_back(random.uniform(i, 3 * k), random.uniform(i, 3 * k + 1),
                          random.uniform(i, 3 * k + 2));
    const BoundingSphere s = fit_sphere(points);
    Real widest = 0;
    for (const Vec3& p : points) {
      ASSERT_LE((p - s.centre).norm(), s.radius * (1 + 1e-15));
      for (const Vec3& q : points) widest = std::max(widest, (p - q).norm());
    }
    // The radius of the smallest sphere is at least half of the largest distance between two points and at
    // most sqrt(3/8) of it (Jung's theorem). The sphere of Ritter's method is at most a fifth larger.
    ASSERT_LE(s.radius, 1.2 * std::sqrt(3.0 / 8) * widest);
  }
  const BoundingSphere ball = fit_sphere(sphere_mesh(2, 40, 20).vertices);
  EXPECT_NEAR(ball.radius, 2, 0.02);
  EXPECT_EQ(fit_sphere(std::array{Vec3(1, 2, 3), Vec3(1, 2, 3)}).radius, 0);
}

}  // namespace
}  // namespace offstage::sim
