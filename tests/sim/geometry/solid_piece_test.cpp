#include "sim/geometry/solid_piece.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "sim/geometry/convex_hull.h"
#include "sim/geometry/hull_merge.h"
#include "sim/geometry/hull_sketch.h"
#include "sim/geometry/mass_properties.h"
#include "tests/meshes.h"
#include "tests/random.h"
#include "tests/solids.h"

namespace offstage::sim {
namespace {

/// Returns a closed surface that intersects itself many times.
TriangleMesh tangle() {
  TriangleMesh mesh = torus_mesh(1, 0.3, 9, 7);
  const Scatter random{5};
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    mesh.vertices[v] += Vec3(random.uniform(v, 0), random.uniform(v, 1), random.uniform(v, 2));
  return mesh;
}

std::vector<TriangleMesh> cut_solids() {
  return {l_solid(), sponge(), hollow_box(), torus_mesh(1, 0.3, 24, 16), tangle()};
}

SolidPiece::Plane random_plane(const TriangleMesh& mesh, uint64_t seed) {
  const Scatter random{seed};
  const Vec3 normal =
      Vec3(random.uniform(1, 0) - 0.5, random.uniform(1, 1) - 0.5, random.uniform(1, 2) - 0.5).normalized();
  Aabb box;
  for (const Vec3& v : mesh.vertices) box.extend(v);
  const Vec3 through = box.min() + box.sizes() * (0.2 + 0.6 * random.uniform(2, 0));
  return {normal, normal.dot(through)};
}

TEST(SolidPiece, CutsKeepTheVolumeAndItsCentre) {
  for (const TriangleMesh& mesh : cut_solids())
    for (uint64_t seed = 0; seed < 10; ++seed) {
      SCOPED_TRACE(seed);
      std::vector<SolidPiece> pieces = {solid_piece(mesh)};
      for (uint64_t k = 0; k < 4; ++k) {
        std::vector<SolidPiece> next;
        for (const SolidPiece& piece : pieces)
          for (SolidPiece& half : cut(piece, random_plane(mesh, 10 * seed + k), 1e-9))
            if (!half.points.empty()) next.push_back(std::move(half));
        pieces = std::move(next);
      }
      EXPECT_GT(pieces.size(), 3u);
      Real volume = 0;
      Vec3 first = Vec3::Zero();
      for (const SolidPiece& piece : pieces) {
        volume += moments(piece).volume;
        first += moments(piece).first;
      }
      const MassProperties whole = mass_properties(mesh);
      EXPECT_NEAR(volume, whole.volume, 1e-9);
      EXPECT_LE((first - whole.volume * whole.centre).norm(), 1e-9);
    }
}

TEST(SolidPiece, MomentsAboveAPlaneAreThoseOfTheCutPiece) {
  for (const TriangleMesh& mesh : cut_solids())
    for (uint64_t seed = 0; seed < 10; ++seed) {
      const SolidPiece piece = cut(solid_piece(mesh), random_plane(mesh, seed), 1e-9)[0];
      if (piece.points.empty()) continue;
      const SolidPiece::Plane plane = random_plane(mesh, seed + 100);
      const PieceMoments above = moments_above(piece, plane), expected = moments(cut(piece, plane, 0)[0]);
      EXPECT_NEAR(above.volume, expected.volume, 1e-9);
      EXPECT_LE((above.first - expected.first).norm(), 1e-9);
    }
}

// A plane along the faces of a solid divides it into its blocks: no face of one block stays on the other.
TEST(SolidPiece, PlanesAlongFacesCutCleanly) {
  const auto halves = cut(solid_piece(l_solid()), {Vec3::UnitX(), 1}, 1e-9);
  ASSERT_FALSE(halves[0].points.empty());
  for (const SolidPiece& half : halves) {
    Aabb box;
    for (const Vec3& p : half.points) box.extend(p);
    EXPECT_NEAR(moments(half).volume, box.volume(), 1e-9);
  }
}

TEST(HullSketch, IsTheVolumeOfTheHull) {
  const Scatter random{3};
  for (uint64_t n : {4, 10, 60, 150}) {
    std::vector<Vec3> points;
    for (uint64_t i = 0; i < n; ++i)
      points.emplace_back(random.uniform(i, n), random.uniform(i, n + 1), random.uniform(i, n + 2));
    EXPECT_NEAR(sketched_hull_volume(points), hull_volume(convex_hull(points)), 1e-9);
  }
  EXPECT_EQ(
      sketched_hull_volume(std::vector<Vec3>{Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), Vec3(1, 1, 0)}), 0);
  const TriangleMesh ball = sphere_mesh(1, 60, 40);
  EXPECT_NEAR(sketched_hull_volume(ball.vertices) / mass_properties(ball).volume, 1, 0.12);
}

ConvexPolyhedron box_at(const Vec3& low, const Vec3& high) {
  std::vector<Vec3> corners;
  for (int k = 0; k < 8; ++k) corners.push_back(Aabb(low, high).corner(static_cast<Aabb::CornerType>(k)));
  return convex_hull(corners);
}

TEST(HullMerge, BlocksBecomeTheirUnionForNothing) {
  std::vector<HullToMerge> blocks;
  for (int i = 0; i < 3; ++i) blocks.push_back({box_at(Vec3(i, 0, 0), Vec3(i + 1, 1, 1)), 0});
  blocks.push_back({box_at(Vec3(0, 1, 0), Vec3(1, 2, 1)), 0});
  const std::vector<MergedHull> merged = HullMerger(blocks).run(8, 1e-6);
  ASSERT_EQ(merged.size(), 2u);  // the L keeps a corner
  EXPECT_NEAR(hull_volume(merged[0].hull) + hull_volume(merged[1].hull), 4, 1e-9);
}

TEST(HullMerge, OverlapOfDifferentSolidsIsNotGainedTwice) {
  const std::vector<HullToMerge> cross = {{box_at(Vec3(-2, -0.5, 0), Vec3(2, 0.5, 1)), 0},
                                          {box_at(Vec3(-0.5, -2, 0), Vec3(0.5, 2, 1)), 1}};
  // The hull is an octagon of 16 - 4 * 9/8 = 11.5, the union has 7.
  EXPECT_EQ(HullMerger(cross).run(2, 4.49).size(), 2u);
  const std::vector<MergedHull> one = HullMerger(cross).run(2, 4.51);
  ASSERT_EQ(one.size(), 1u);
  EXPECT_NEAR(one[0].shared, 1, 1e-9);
}

}  // namespace
}  // namespace offstage::sim
