#include "sim/collision/clearance_grid.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "sim/collision/distance.h"
#include "tests/meshes.h"
#include "tests/random.h"

namespace offstage::sim {
namespace {

Vec3 random_point(uint64_t i, const Vec3& size) {
  const Scatter random{1};
  return size.cwiseProduct(Vec3(random.uniform(i, 0), random.uniform(i, 1), random.uniform(i, 2)) -
                           Vec3::Constant(0.5));
}

TriangleMesh open_box() {
  TriangleMesh mesh = box_mesh({2, 1, 1});
  mesh.triangles.resize(10);
  return mesh;
}

TEST(ClearanceGrid, ClearPointsTouchNothingAndAreNotInside) {
  for (const TriangleMesh& mesh : {torus_mesh(1, 0.4, 48, 24), box_mesh({3, 0.5, 0.01}), open_box()}) {
    const CollisionMesh reference(mesh);
    const ClearanceGrid cells(mesh, reference.solid);
    for (uint64_t i = 0; i < 4000; ++i) {
      const Vec3 p = random_point(i, {5, 3, 5});
      const Real distance = signed_distance(reference, p).distance;
      EXPECT_FALSE(cells.is_clear(p, std::max(distance, 0.0) + 1e-9)) << p.transpose();
      EXPECT_FALSE(distance <= 0 && cells.is_clear(p, 0)) << p.transpose();
    }
  }
}

TEST(ClearanceGrid, ALimitedSearchIsAsExactAsAFullOne) {
  constexpr Real kLimit = 0.05;
  const Shape shape = MeshShape{};
  int near = 0;
  for (const TriangleMesh& mesh : {torus_mesh(1, 0.4, 48, 24), box_mesh({3, 0.5, 0.01}), open_box()}) {
    const CollisionMesh solid(mesh);
    for (uint64_t i = 0; i < 4000; ++i) {
      const Vec3 p = random_point(i, {3, 1.2, 3});
      const SurfaceDistance whole = signed_distance(solid, p);
      const SurfaceDistance below = signed_distance_below({&shape, &solid}, p, kLimit);
      near += whole.distance < kLimit;
      EXPECT_EQ(below.distance < kLimit, whole.distance < kLimit) << p.transpose();
      if (whole.distance >= kLimit) continue;
      EXPECT_EQ(below.distance, whole.distance) << p.transpose();
      EXPECT_EQ(below.normal, whole.normal) << p.transpose();
    }
  }
  EXPECT_GT(near, 500);
}

TEST(ClearanceGrid, PointsThreeCellsAwayAreClear) {
  // For a small sphere. Its own cell and the surface's cell cost one cell each, and distances along a cell
  // diagonal cost a factor sqrt(3).
  const CollisionMesh torus(torus_mesh(1, 0.4, 48, 24));
  const ClearanceGrid cells(torus.mesh, torus.solid);
  int tried = 0;
  for (uint64_t i = 0; i < 4000; ++i) {
    const Vec3 p = random_point(i, {2.8, 0.8, 2.8});
    const Real distance = signed_distance(torus, p).distance;
    if (distance <= 3 * std::sqrt(3.0) * cells.cell()) continue;
    ++tried;
    EXPECT_TRUE(cells.is_clear(p, 0.5 * cells.cell())) << p.transpose();
  }
  EXPECT_GT(tried, 500);
}

TEST(ClearanceGrid, AMeshWithoutExtentIsNearAndFar) {
  const ClearanceGrid none({}, false), point({{Vec3(1, 2, 3)}, {{0, 0, 0}}}, false);
  EXPECT_TRUE(none.is_clear({0, 0, 0}, 0.1));
  EXPECT_FALSE(point.is_clear({1, 2, 3}, 0));
}

}  // namespace
}  // namespace offstage::sim
