#include "tests/mesh_pair.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <fcl/fcl.h>
#include <gtest/gtest.h>

#include "sim/collision/narrow_phase.h"
#include "tests/mesh_pair_oracle.h"
#include "tests/meshes.h"

namespace offstage::sim {
namespace {

TEST(MeshPair, CoincidentMeshesMeetInEveryTouchingPair) {
  const TriangleMesh mesh = bumpy_sphere(10, 6, 3);
  const AllTrees trees(mesh);
  const Pose poses[] = {{}, {Vec3::Zero(), Quat(0, 1, 0, 0)}, {Vec3(1, 0, 0)}, {Vec3(1e-9, 0, 0)}};
  for (const Pose& pose : poses) {
    const auto brute = brute_pairs(mesh, mesh, pose);
    EXPECT_GT(brute.size(), 0u);
    for_each_kind(trees, trees, [&](const auto& a, const auto& b) {
      std::vector<TrianglePair> pairs;
      intersecting_triangles(a, b, pose, pairs);
      std::sort(pairs.begin(), pairs.end());
      ASSERT_EQ(pairs, brute);
    });
  }
}

TEST(MeshPair, BoxesFaceToFaceTouchAndTheSmallestGapSeparates) {
  for (Real size : {1e-3, 1.0, 100.0}) {
    const TriangleMesh box = box_mesh(Vec3::Constant(size));
    const AllTrees trees(box);
    for_each_kind(trees, trees, [&](const auto& a, const auto& b) {
      EXPECT_TRUE(surfaces_intersect(a, b, {Vec3(size, 0, 0)}));
      EXPECT_TRUE(surfaces_intersect(a, b, {Vec3(size, size, -size)})) << "corner to corner";
      EXPECT_FALSE(surfaces_intersect(a, b, {Vec3(size * (1 + 1e-15), 0, 0)}));
      const auto closest = closest_triangles(a, b, {Vec3(1.25 * size, 0, 0)});
      EXPECT_NEAR(std::sqrt(closest->points.squared_distance), 0.25 * size, 1e-15 * size);
    });
  }
}

TEST(MeshPair, CloseTrianglesAreThoseOfBruteForceWithTheirPoints) {
  const TriangleMesh mesh_a = bumpy_sphere(12, 8, 1), mesh_b = torus_mesh(0.8, 0.3, 12, 8);
  const AllTrees trees_a(mesh_a), trees_b(mesh_b);
  for (uint64_t i = 0; i < 8; ++i) {
    const Pose pose = random_pose(i, 2.2);
    const Real tolerance = i % 2 == 0 ? 0 : 0.1;
    std::vector<TrianglePair> brute;
    for_each_brute_pair(mesh_a, mesh_b, pose, [&](TrianglePair t, const auto& a, const auto& b) {
      if (closest_on_triangles(a, b).squared_distance <= tolerance * tolerance) brute.push_back(t);
    });
    for_each_kind(trees_a, trees_b, [&](const auto& a, const auto& b) {
      std::vector<CloseTriangles> close;
      close_triangles(a, b, pose, tolerance, close);
      std::vector<TrianglePair> pairs;
      for (const CloseTriangles& c : close) {
        pairs.push_back(c.triangles);
        ASSERT_LE((c.points.on_a - c.points.on_b).norm(), tolerance + 1e-15);
      }
      std::sort(pairs.begin(), pairs.end());
      ASSERT_EQ(pairs, brute);
    });
  }
}

TEST(MeshPair, ClosestTrianglesAreThoseOfBruteForceColdAndWarm) {
  const TriangleMesh mesh_a = bumpy_sphere(12, 8, 1), mesh_b = torus_mesh(0.8, 0.3, 12, 8);
  const AllTrees trees_a(mesh_a), trees_b(mesh_b);
  TrianglePair last = {1000, 1000};  // an initial pair out of range is ignored
  for (uint64_t i = 0; i < 8; ++i) {
    const Pose pose = random_pose(i, 3.5);
    Real least2 = 1e30;
    for_each_brute_pair(mesh_a, mesh_b, pose, [&](TrianglePair, const auto& a, const auto& b) {
      least2 = std::min(least2, closest_on_triangles(a, b).squared_distance);
    });
    const Real least = std::sqrt(least2);
    for_each_kind(trees_a, trees_b, [&](const auto& a, const auto& b) {
      const auto cold = closest_triangles(a, b, pose), warm = closest_triangles(a, b, pose, last);
      ASSERT_EQ(cold->points.squared_distance, least2) << i;
      ASSERT_EQ(warm->points.squared_distance, least2) << i;
      ASSERT_EQ(closest_triangles(a, b, pose, last, least)->points.squared_distance, least2);
      ASSERT_TRUE(least == 0 || !closest_triangles(a, b, pose, last, 0.999 * least));
      last = warm->triangles;
    });
  }
}

TEST(MeshPair, ShapesByTrianglesHaveTheDistanceOfTheirTriangles) {
  const Shape mesh_shape = MeshShape{};
  const CollisionMesh mesh_a(bumpy_sphere(12, 8, 1)), mesh_b(torus_mesh(0.8, 0.3, 12, 8));
  const auto shapes_of = [&](const CollisionMesh& mesh) {
    std::vector<CollisionShape> shapes;
    for (const TreeVolume volume : {TreeVolume::aabb, TreeVolume::obb, TreeVolume::sphere})
      shapes.emplace_back(Solid{&mesh_shape, &mesh},
                          CollisionShape::Options{.by_triangles = true, .tree = {volume, TreeSplit::mean}});
    return shapes;
  };
  const std::vector<CollisionShape> shapes_a = shapes_of(mesh_a), shapes_b = shapes_of(mesh_b);
  int apart = 0, meeting = 0;
  for (uint64_t i = 0; i < 40; ++i) {
    const Pose pose = random_pose(i, 3);
    const Real exact = std::sqrt(
        closest_triangles(mesh_tree(mesh_a.mesh, mesh_a.tree), mesh_tree(mesh_b.mesh, mesh_b.tree), pose)
            ->points.squared_distance);
    ++(exact > 0 ? apart : meeting);
    for (const CollisionShape& a : shapes_a)
      for (const CollisionShape& b : shapes_b) {
        ASSERT_EQ(touching(a, b, pose), exact == 0) << i;
        PairCache cache;
        const Real distance = separation(a, b, pose, cache)->distance;
        ASSERT_NEAR(std::max(distance, 0.0), exact, 1e-12) << i;
      }
  }
  EXPECT_GT(apart, 10);
  EXPECT_GT(meeting, 10);
}

TEST(MeshPair, EmptyMeshesMeetNothing) {
  const TriangleMesh box = box_mesh(Vec3::Ones()), none;
  const AllTrees trees(box), no_trees(none);
  for_each_kind(trees, no_trees, [&](const auto& a, const auto& b) {
    EXPECT_FALSE(surfaces_intersect(a, b, {}));
    EXPECT_FALSE(closest_triangles(b, a, {}));
  });
}

// The results are compared with the library FCL.
TEST(MeshPair, AgreesWithFcl) {
  const TriangleMesh mesh_a = bumpy_sphere(12, 8, 1), mesh_b = torus_mesh(0.8, 0.3, 12, 8);
  const AllTrees trees_a(mesh_a), trees_b(mesh_b);
  const auto model = [](const TriangleMesh& mesh) {
    auto tree = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
    std::vector<fcl::Triangle> triangles;
    for (const auto& [a, b, c] : mesh.triangles) triangles.emplace_back(a, b, c);
    tree->beginModel();
    tree->addSubModel(mesh.vertices, triangles);
    tree->endModel();
    return tree;
  };
  const fcl::CollisionObjectd fcl_a(model(mesh_a));
  fcl::CollisionObjectd fcl_b(model(mesh_b));
  int touching = 0;
  for (uint64_t i = 0; i < 100; ++i) {
    const Pose pose = random_pose(i, 3.0);
    fcl_b.setTransform(pose.orientation, pose.position);
    fcl::CollisionResultd collision;
    const bool collide = fcl::collide(&fcl_a, &fcl_b, fcl::CollisionRequestd(1, false), collision) > 0;
    fcl::DistanceResultd distance;
    fcl::distance(&fcl_a, &fcl_b, fcl::DistanceRequestd(), distance);
    touching += collide;
    for_each_kind(trees_a, trees_b, [&](const auto& a, const auto& b) {
      ASSERT_EQ(surfaces_intersect(a, b, pose), collide) << i;
      const Real ours = std::sqrt(closest_triangles(a, b, pose)->points.squared_distance);
      ASSERT_NEAR(ours, collide ? 0 : distance.min_distance, 1e-9) << i;
    });
  }
  EXPECT_GT(touching, 20);
  EXPECT_LT(touching, 80);
}

}  // namespace
}  // namespace offstage::sim
