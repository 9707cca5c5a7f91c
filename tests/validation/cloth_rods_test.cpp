/// Validation rows on thin bodies that fall on cloth end first: none passes it (physics F7).

#include <cmath>
#include <variant>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "sim/geometry/intersection.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr Real kRodLength = 0.3;

/// Whether the axis of a rod passes through a triangle of the cloth.
bool pierces(const World& world, BodyHandle rod, ClothHandle cloth) {
  const BodyState state = world.body(rod);
  const Vec3 half = kRodLength / 2 * state.pose.vector_to_world(Vec3::UnitY());
  const ClothView view = world.cloth(cloth);
  for (const Triangle& t : view.triangles)
    if (segment_intersects_triangle(state.centre - half, state.centre + half,
                                    {view.points[t[0]], view.points[t[1]], view.points[t[2]]}))
      return true;
  return false;
}

/// Drops a rod of 0.5 kg and 1 cm diameter, end first, on a cloth with a pinned border and without a limit of
/// stretch. Returns the number of frames in which its axis passes through the cloth.
int drop_rod(const Shape& shape, Real speed, Real step) {
  World world({.max_step = step});
  constexpr uint32_t kCells = 40;
  ClothDef def =
      effects::grid_cloth({1, 1, kCells, kCells}, {{0, 1, 0}}, effects::find_fabric("cotton")->fabric);
  def.max_stretch = def.max_shear = 0;
  for (uint32_t i = 0; i <= kCells; ++i)
    for (uint32_t k : {i, kCells * (kCells + 1) + i, (kCells + 1) * i, (kCells + 1) * i + kCells})
      def.pins.push_back({.vertex = k, .position = def.vertices[k]});
  const ClothHandle cloth = world.add_cloth(def);
  const BodyHandle rod = world.add_body(
      {.shape = shape, .pose = {{0.013, 1.2, 0.021}}, .velocity = {0, -speed, 0}, .mass = 0.5});
  Real fastest = 0;
  int pierced = 0;
  for (int i = 0; i < 18; ++i) {
    world.step(1.0 / 60);
    pierced += pierces(world, rod, cloth);
    fastest = std::max(fastest, world.body(rod).velocity.norm());
  }
  EXPECT_FALSE(pierces(world, rod, cloth));
  // It bounces, without more energy than at the start.
  EXPECT_GT(world.body(rod).velocity.y(), 0);
  EXPECT_LT(fastest, std::sqrt(speed * speed + 2 * 9.81 * 0.6));
  return pierced;
}

TEST(ClothUnderARod, StopsARoundEnd) {
  EXPECT_EQ(drop_rod(Capsule{0.005, kRodLength}, 2, 1.0 / 60), 0);
  EXPECT_EQ(drop_rod(Capsule{0.005, kRodLength}, 10, 1.0 / 60), 0);
  EXPECT_EQ(drop_rod(Capsule{0.005, kRodLength}, 10, 1.0 / 240), 0);
}

/// The sharp rim may put its axis through a triangle for some frames before the triangle is pushed back.
TEST(ClothUnderARod, StopsAFlatEnd) {
  EXPECT_LT(drop_rod(Cylinder{0.005, kRodLength}, 2, 1.0 / 60), 6);
}

}  // namespace
}  // namespace offstage::sim
