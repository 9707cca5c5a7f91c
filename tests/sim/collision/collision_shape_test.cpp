/// Shapes with trees of every kind, and meshes by their triangles.

#include "sim/collision/collision_shape.h"

#include <memory>

#include <gtest/gtest.h>

#include "meshes.h"
#include "random.h"
#include "sim/collision/narrow_phase.h"

namespace offstage::sim {
namespace {

using ShapeOptions = CollisionShape::Options;

Pose scattered_pose(const Scatter& random, uint64_t i, Real spread) {
  const auto u = [&](uint64_t k) { return 2 * random.uniform(i, k) - 1; };
  return {spread * Vec3(u(0), u(1), u(2)), Quat(u(3), u(4), u(5), u(6)).normalized()};
}

/// A torus and a box that moves beside it, as shapes with a kind of tree each.
struct TreeShapes {
  Shape mesh_shape = MeshShape{}, box_shape = Box{{0.3, 0.2, 0.4}};
  CollisionMesh mesh{torus_mesh(0.5, 0.2, 16, 8)};
  Solid solid{&mesh_shape, &mesh}, box{&box_shape, nullptr};
};

constexpr std::array kVolumes = {TreeVolume::aabb, TreeVolume::obb, TreeVolume::sphere};

TEST(CollisionShapes, EveryKindOfTreeGivesTheSameDistancesAndImpacts) {
  const TreeShapes s;
  const CollisionShape usual(s.solid, ShapeOptions{.by_triangles = true}), box(s.box, ShapeOptions{});
  const Scatter random{31};
  for (const TreeVolume volume : kVolumes)
    for (const TreeSplit split : {TreeSplit::mean, TreeSplit::surface_area}) {
      const CollisionShape ring(s.solid, ShapeOptions{.by_triangles = true, .tree = {volume, split}}),
          cube(s.box, ShapeOptions{.tree = {volume, split}});
      EXPECT_EQ(ring.piece_count(), usual.piece_count());
      for (uint64_t i = 0; i < 12; ++i) {
        const Pose a_from_b = scattered_pose(random, i, 1.2);
        PairCache cache, other;
        for (const auto& [b, same] : {std::pair(&usual, &ring), std::pair(&box, &cube)}) {
          const auto expected = separation(usual, *b, a_from_b, cache),
                     found = separation(ring, *same, a_from_b, other);
          ASSERT_TRUE(expected && found);
          // The deepest of several overlapping pieces depends on the order in which they are found.
          EXPECT_EQ(found->distance > 0, expected->distance > 0);
          if (expected->distance > 0) {
            EXPECT_NEAR(found->distance, expected->distance, 1e-9);
          }
          EXPECT_EQ(touching(ring, *same, a_from_b), touching(usual, *b, a_from_b));
          const PosePath rest{Pose{}, Pose{}}, path(scattered_pose(random, i + 100, 2), a_from_b);
          TestCounts counts;
          const auto first = time_of_impact({usual, rest}, {*b, path}, 1e-4),
                     second = time_of_impact({ring, rest, &counts}, {*same, path}, 1e-4);
          ASSERT_EQ(first.has_value(), second.has_value());
          if (first) {
            EXPECT_NEAR(first->fraction, second->fraction, 1e-3);
          }
          EXPECT_GT(counts.volumes, 0u);
        }
        EXPECT_GT(other.tests.pieces, 0u);
      }
    }
}

// Two tori as triangles are as far apart as their convex parts are, and intersect where these overlap.
TEST(CollisionShapes, TrianglesMeetWhereThePartsDo) {
  const TreeShapes s;
  const CollisionShape parts(s.solid, ShapeOptions{.needs_volume = true}),
      triangles(s.solid, ShapeOptions{.by_triangles = true});
  ASSERT_FALSE(parts.surface());
  const Scatter random{32};
  int apart = 0, together = 0;
  for (uint64_t i = 0; i < 200; ++i) {
    const Pose a_from_b = scattered_pose(random, i, 1);
    PairCache cache, other;
    const auto p = separation(parts, parts, a_from_b, cache),
               t = separation(triangles, triangles, a_from_b, other);
    ASSERT_TRUE(p && t);
    if (p->distance > 1e-6) {
      ++apart;
      EXPECT_NEAR(t->distance, p->distance, 1e-6);
      EXPECT_FALSE(touching(triangles, triangles, a_from_b));
    } else if (p->distance < -1e-6) {
      ++together;
      EXPECT_LE(t->distance, 1e-9);
      EXPECT_TRUE(touching(triangles, triangles, a_from_b));
    }
  }
  EXPECT_GT(apart, 30);
  EXPECT_GT(together, 30);
}

}  // namespace
}  // namespace offstage::sim
