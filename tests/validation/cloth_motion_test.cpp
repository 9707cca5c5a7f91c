/// Cloth that is pinned, touches itself or lies on a turning ball keeps moving. Its moves are shortened in
/// most sub-steps, which must neither stop it nor give it energy. Cloth that hangs over a box comes to rest.

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr uint32_t kMovingCells = 24;

/// Returns a square metre of cloth in a vacuum, horizontal at first and pinned along one edge.
ClothDef hanging_cloth(const std::string& fabric) {
  ClothDef def =
      effects::grid_cloth({1, 1, kMovingCells, kMovingCells}, {}, effects::find_fabric(fabric)->fabric);
  def.air.density = 0;
  for (uint32_t i = 0; i <= kMovingCells; ++i) def.pins.push_back({.vertex = i, .position = def.vertices[i]});
  return def;
}

/// Returns a square metre of cloth that is pinned only at two corners, between which it swings and folds onto
/// itself.
ClothDef folding_cloth(const std::string& fabric) {
  ClothDef def = hanging_cloth(fabric);
  def.pins = {def.pins.front(), def.pins.back()};
  return def;
}

struct SwingRecord {
  Real fall = 0;     // energy of the fall of all points to where they hang straight down [J]
  Real rise = 0;     // greatest increase of the energy over its smallest earlier value [J]
  Real kinetic = 0;  // greatest kinetic energy in the last second [J]
  uint64_t limited = 0, touches = 0, crossings = 0;
};

SwingRecord swing_of(const ClothDef& def, Real step) {
  constexpr Real kSeconds = 3;
  World world({.max_step = step});
  const ClothHandle cloth = world.add_cloth(def);
  SwingRecord motion;
  for (std::size_t i = 0; i < def.masses.size(); ++i)
    motion.fall += def.masses[i] * 9.81 * (def.vertices[i].z() - def.vertices[0].z());
  Real least = world.energy().total();
  for (int i = 0; i < kSeconds / step; ++i) {
    world.step(step);
    const Real now = world.energy().total();
    motion.rise = std::max(motion.rise, now - least);
    least = std::min(least, now);
    motion.limited += world.cloth_report(cloth).limited;
    motion.touches += world.cloth_report(cloth).self_contacts;
    motion.crossings += world.cloth_report(cloth).crossings;
    if (i * step > kSeconds - 1) motion.kinetic = std::max(motion.kinetic, world.energy().kinetic);
  }
  return motion;
}

/// Parameters: fabric, step of the world [s].
class MovingCloth : public testing::TestWithParam<std::tuple<std::string, Real>> {};

TEST_P(MovingCloth, SwingsOnAtItsStretchLimitAndGainsNothing) {
  const auto [fabric, step] = GetParam();
  ClothDef def = hanging_cloth(fabric);
  def.max_stretch = 1.01;
  const SwingRecord motion = swing_of(def, step);
  EXPECT_GT(motion.limited, 1000);
  EXPECT_LT(motion.rise, 0.03 * motion.fall);
  EXPECT_GT(motion.kinetic, 0.1 * motion.fall);
  EXPECT_EQ(motion.crossings, 0);
}

TEST_P(MovingCloth, SwingsOnWhileItTouchesItselfAndGainsNothing) {
  const auto [fabric, step] = GetParam();
  const SwingRecord motion = swing_of(folding_cloth(fabric), step);
  EXPECT_GT(motion.touches, 50);
  EXPECT_LT(motion.rise, 0.03 * motion.fall);
  EXPECT_GT(motion.kinetic, 0.1 * motion.fall);
  EXPECT_EQ(motion.crossings, 0);
}

INSTANTIATE_TEST_SUITE_P(Fabrics, MovingCloth,
                         testing::Combine(testing::Values("silk", "cotton"),
                                          testing::Values(1.0 / 60, 1.0 / 240)));

/// Parameters: whether the cloth has self-collision, max_stretch.
class TurningBall : public testing::TestWithParam<std::tuple<bool, Real>> {};

TEST_P(TurningBall, TakesItsClothAlong) {
  // Friction drags the cloth until it turns as the ball does; its stretch limit is reached.
  constexpr Real kSpin = 3;
  const auto [self_collision, max_stretch] = GetParam();
  ClothDef def =
      effects::grid_cloth({1, 1, 20, 20}, {Vec3(0, 0.36, 0)}, effects::find_fabric("cotton")->fabric);
  def.air.density = 0;
  def.self_collision = self_collision;
  def.max_stretch = max_stretch;
  World world({.max_step = 1.0 / 240});
  world.add_body({.shape = Sphere{0.35},
                  .motion = MotionType::kinematic,
                  .friction = 1,
                  .track = {.spin = {0, kSpin, 0}}});
  const ClothHandle cloth = world.add_cloth(def);
  uint64_t limited = 0;
  Real spin = 0, inertia = 0;  // about the axis of the ball
  for (int i = 0; i < 240; ++i) {
    world.step(1.0 / 60);
    limited += world.cloth_report(cloth).limited;
    if (i < 180) continue;
    const ClothView view = world.cloth(cloth);
    for (std::size_t k = 0; k < view.points.size(); ++k) {
      const Vec3 &p = view.points[k], &v = view.velocities[k];
      spin += def.masses[k] * (p.z() * v.x() - p.x() * v.z());
      inertia += def.masses[k] * (p.z() * p.z() + p.x() * p.x());
    }
  }
  EXPECT_GT(limited, 300);
  // Cloth that can hardly stretch also slips: where parts of it would cross, they stop.
  EXPECT_NEAR(spin / inertia, kSpin, (max_stretch > 1.002 ? 0.03 : 0.1) * kSpin);
}

INSTANTIATE_TEST_SUITE_P(SelfCollision, TurningBall,
                         testing::Combine(testing::Bool(), testing::Values(1.005, 1.001)));

/// Parameters: fabric and whether the box is dynamic.
class HangingCloth : public testing::TestWithParam<std::tuple<std::string, bool>> {};

TEST_P(HangingCloth, ReportsTheVelocityOfItsMotion) {
  // A sheet lies on a box and hangs over its edges and corners, which touch triangles between their points.
  // If triangles that move onto a corner within the springs' steps were put back after them, points there
  // would report 0.4 m/s without moving.
  const auto [fabric, is_dynamic] = GetParam();
  World world({.max_step = 1.0 / 60});
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  world.add_body({.shape = Box{Vec3(0.6, 0.6, 0.6)},
                  .motion = is_dynamic ? MotionType::dynamic : MotionType::static_body,
                  .pose = {Vec3(0, 0.3, 0)},
                  .mass = 50});
  ClothDef def =
      effects::grid_cloth({1, 1, 30, 30}, {Vec3(0.05, 0.62, 0.02)}, effects::find_fabric(fabric)->fabric);
  def.self_collision = false;
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 180; ++i) world.step(1.0 / 60);
  Real difference = 0;
  for (int i = 0; i < 60; ++i) {
    const std::vector<Vec3> before(world.cloth(cloth).points.begin(), world.cloth(cloth).points.end());
    world.step(1.0 / 960);
    const ClothView view = world.cloth(cloth);
    Real sum = 0;
    for (std::size_t k = 0; k < before.size(); ++k)
      sum += (view.velocities[k] - 960 * (view.points[k] - before[k])).squaredNorm();
    difference += std::sqrt(sum / static_cast<Real>(before.size())) / 60;
  }
  EXPECT_LT(difference, 0.002);
}

INSTANTIATE_TEST_SUITE_P(Fabrics, HangingCloth,
                         testing::Combine(testing::Values("silk", "cotton"), testing::Bool()));

// Taut cloth that tumbles in the wind beside the ground. Shortening of moves stopped all points of such a
// cloth in each sub-step, while its velocity went on: it hung in the air until the end of the film.
TEST(FrozenCloth, MovesOn) {
  for (const int trial : {21, 54, 117, 134, 141}) {
    const Real wind = 5 + 0.07 * trial, tilt = 0.4 + 0.0077 * trial;
    World world({.wind = Vec3(wind, 0, 0.3 * (trial % 10) - 1.5)});
    world.add_body({.name = "ground", .shape = Plane{}, .motion = MotionType::static_body});
    const Pose pose{Vec3(0, 0.8, 0), Quat(Eigen::AngleAxis<Real>(tilt, Vec3(1, 0, 0.3).normalized()))};
    const char* fabric = std::array{"silk", "cotton", "denim"}[static_cast<std::size_t>(trial % 3)];
    const ClothHandle cloth =
        world.add_cloth(effects::grid_cloth({0.8, 0.6, 10, 8}, pose, effects::find_fabric(fabric)->fabric));
    int frozen = 0, longest = 0;
    for (int frame = 0; frame < 240; ++frame) {
      const std::vector<Vec3> before(world.cloth(cloth).points.begin(), world.cloth(cloth).points.end());
      world.step(1.0 / 60);
      const ClothView view = world.cloth(cloth);
      Real moved = 0, speed = 0;
      for (std::size_t i = 0; i < before.size(); ++i) {
        moved = std::max(moved, (view.points[i] - before[i]).norm());
        speed = std::max(speed, view.velocities[i].norm());
      }
      frozen = speed > 0.5 && moved < 1e-3 * speed / 60 ? frozen + 1 : 0;
      longest = std::max(longest, frozen);
    }
    EXPECT_LT(longest, 3) << fabric << " in a wind of " << wind;
  }
}

}  // namespace
}  // namespace offstage::sim
