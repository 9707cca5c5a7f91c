/// Validation rows on cloth: among bodies, with itself, both ways.

#include "effects/cloth.h"

#include <cmath>

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "sim/collision/bounding_tree.h"
#include "sim/geometry/intersection.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

std::size_t crossings(const ClothView& cloth) {
  std::vector<Aabb> boxes;
  for (const Triangle& t : cloth.triangles) {
    Aabb& box = boxes.emplace_back();
    for (uint32_t corner : t) box.extend(cloth.points[corner]);
  }
  const AabbTree tree(boxes);
  const auto corners = [&](const Triangle& t) {
    return TriangleVertices{cloth.points[t[0]], cloth.points[t[1]], cloth.points[t[2]]};
  };
  std::size_t count = 0;
  for (uint32_t i = 0; i < boxes.size(); ++i)
    tree.overlapping(boxes[i], [&](uint32_t j) {
      const Triangle &a = cloth.triangles[i], &b = cloth.triangles[j];
      for (uint32_t p : a)
        for (uint32_t q : b)
          if (p == q) return;
      count += j > i && boxes[i].intersects(boxes[j]) && triangles_intersect(corners(a), corners(b));
    });
  return count;
}

Real speed(const ClothView& cloth) {
  Real sum = 0;
  for (const Vec3& v : cloth.velocities) sum += v.squaredNorm();
  return std::sqrt(sum / static_cast<Real>(cloth.velocities.size()));
}

ClothDef sheet(Real size, uint32_t cells, const Vec3& place) {
  return effects::grid_cloth({size, size, cells, cells}, {place}, effects::find_fabric("cotton")->fabric);
}

/// Drops a cloth for some seconds; nothing may be inside of a body or cross itself at any frame.
void drop(World& world, ClothHandle cloth, int frames) {
  for (int i = 0; i < frames; ++i) {
    const StepReport report = world.step(1.0 / 24);
    ASSERT_TRUE(report.finite);
    ASSERT_EQ(report.cloth_penetration, 0);
    ASSERT_EQ(report.cloth_crossings, 0u);
    ASSERT_EQ(crossings(world.cloth(cloth)), 0u);
  }
}

TEST(ClothValidation, ComesToRestOnASphere) {
  World world;
  world.add_body({.shape = Plane{}, .motion = MotionType::fixed});
  world.add_body({.shape = Sphere{0.5}, .motion = MotionType::fixed, .pose = {{0, 0.5, 0}}});
  const ClothHandle cloth = world.add_cloth(sheet(1.6, 24, {0.05, 1.1, 0}));
  drop(world, cloth, 120);
  EXPECT_LT(speed(world.cloth(cloth)), 0.1);
}

TEST(ClothValidation, ComesToRestOnTheEdgeOfABox) {
  World world;
  world.add_body({.shape = Plane{}, .motion = MotionType::fixed});
  world.add_body({.shape = Box{{1, 0.5, 1}}, .motion = MotionType::fixed, .pose = {{0, 0.25, 0}}});
  const ClothHandle cloth = world.add_cloth(sheet(1.2, 24, {0.5, 0.7, 0}));
  drop(world, cloth, 120);
  EXPECT_LT(speed(world.cloth(cloth)), 0.1);
}

TEST(ClothValidation, ADishRestsOnAClothOnATable) {
  World world;
  world.add_body({.shape = Box{{1, 0.5, 1}}, .motion = MotionType::fixed, .pose = {{0, 0.25, 0}}});
  const ClothHandle cloth = world.add_cloth(sheet(0.8, 24, {0, 0.51, 0}));
  const BodyHandle dish =
      world.add_body({.shape = Cylinder{0.12, 0.05}, .pose = {{0, 0.55, 0}}, .mass = 0.4});
  drop(world, cloth, 72);
  const Vec3 place = world.body(dish).centre;
  drop(world, cloth, 24);
  EXPECT_LT((world.body(dish).centre - place).norm(), 2e-3);  // it creeps by less than 2 mm in a second
  // The dish lies two thicknesses above the table, less the overlap that holds it.
  EXPECT_NEAR(place.y(), 0.5 + 0.025 + 2 * world.cloth_def(cloth).thickness, 2e-3);
}

TEST(ClothValidation, ExchangesMomentumWithABody) {
  World world({.gravity = Vec3::Zero()});
  ClothDef def = sheet(0.6, 16, Vec3::Zero());
  def.air.density = 0;
  const ClothHandle cloth = world.add_cloth(def);
  const BodyHandle ball =
      world.add_body({.shape = Sphere{0.1}, .pose = {{0, 0.3, 0}}, .velocity = {0, -2, 0}, .mass = 0.5});
  const auto momentum = [&] {
    Vec3 sum = 0.5 * world.body(ball).velocity;
    const ClothView view = world.cloth(cloth);
    for (std::size_t i = 0; i < view.points.size(); ++i) sum += def.masses[i] * view.velocities[i];
    return sum;
  };
  for (int i = 0; i < 24; ++i) world.step(1.0 / 24);
  EXPECT_LT(world.body(ball).velocity.norm(), 1.99);
  // Overlaps are taken back without motion, which is what is lost here.
  EXPECT_NEAR((momentum() - Vec3(0, -1, 0)).norm(), 0, 0.02);
}

TEST(ClothValidation, IsTheSameBitsForAnyNumberOfThreads) {
  StateHash hashes[2];
  for (std::size_t threads : {1, 2}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    World world;
    world.add_body({.shape = Sphere{0.5}, .motion = MotionType::fixed, .pose = {{0, 0.5, 0}}});
    world.add_cloth(sheet(2, 48, {0, 1.05, 0}));
    for (int i = 0; i < 24; ++i) world.step(1.0 / 24);
    hashes[threads - 1] = world.state_hash();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

}  // namespace
}  // namespace offstage::sim
