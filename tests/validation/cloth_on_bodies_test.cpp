/// Contacts between cloth and bodies add no energy: cloth that is pinned at the surface of a body or inside
/// it, and cloth on a body with many small faces.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "sim/geometry/solid_mesh.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr Real kThickness = 0.005;

struct ContactRecord {
  Real strain = 0;      // greatest strain
  Real rise = 0;        // greatest energy above the initial energy [J]
  Real last_speed = 0;  // greatest speed of a vertex in the last tenth of the run [m/s]
};

ContactRecord run(World& world, ClothHandle cloth, Real step, Real seconds) {
  ContactRecord record;
  const Real first = world.energy().total();
  for (int i = 0; i < seconds / step; ++i) {
    world.step(step);
    record.strain = std::max(record.strain, world.cloth_report(cloth).max_strain);
    record.rise = std::max(record.rise, world.energy().total() - first);
    if (i * step < 0.9 * seconds) continue;
    for (const Vec3& v : world.cloth(cloth).velocities)
      record.last_speed = std::max(record.last_speed, v.norm());
  }
  return record;
}

ClothDef cotton(const effects::GridSize& size, const Pose& pose, ClothIntegrator integrator) {
  ClothDef def = effects::grid_cloth(size, pose, effects::find_fabric("cotton")->fabric);
  def.thickness = kThickness;
  def.integrator = integrator;
  return def;
}

void pin(ClothDef& def, uint32_t vertex) {
  def.pins.push_back({.vertex = vertex, .position = def.vertices[vertex]});
}

// The part of the conveyor's velocity across the surface has no effect.
TEST(ClothOnAConveyor, MovesWithIt) {
  for (const Real step : {1.0 / 240, 1.0 / 60}) {
    World world({.max_step = step});
    world.add_body({.shape = Box{Vec3(8, 0.2, 2)},
                    .motion = MotionType::static_body,
                    .pose = {Vec3(0, -0.1, 0)},
                    .friction = 0.5,
                    .surface_velocity = {1, 1, 0}});
    const ClothHandle cloth = world.add_cloth(
        cotton({0.6, 0.6, 8, 8}, {Vec3(0, kThickness, 0), Quat::Identity()}, ClothIntegrator::relaxed));
    run(world, cloth, step, 2);
    for (const Vec3& v : world.cloth(cloth).velocities) EXPECT_LT((v - Vec3::UnitX()).norm(), 1e-3);
    for (const Vec3& p : world.cloth(cloth).points) EXPECT_NEAR(p.y(), kThickness, 1e-5);
  }
}

class ClothPinnedAtABody : public testing::TestWithParam<std::tuple<ClothIntegrator, Real>> {
 protected:
  ClothIntegrator integrator() const { return std::get<0>(GetParam()); }
  Real step() const { return std::get<1>(GetParam()); }
};

TEST_P(ClothPinnedAtABody, HangsFromTheEdgeOfABox) {
  World world({.max_step = step()});
  world.add_body(
      {.shape = Box{Vec3(0.1, 0.1, 0.5)}, .motion = MotionType::static_body, .pose = {Vec3(0.55, 0, 0)}});
  const effects::GridSize size{1, 0.4, 10, 4};
  ClothDef def = cotton(size, {Vec3(0, 0.05, 0)}, integrator());
  for (uint32_t row = 0; row <= size.rows; ++row) pin(def, effects::grid_vertex(size, size.columns, row));
  const ClothHandle cloth = world.add_cloth(def);
  const ContactRecord record = run(world, cloth, step(), 1.5);
  EXPECT_LT(record.strain, 0.003);  // 0.0019 without the box
  EXPECT_LT(record.rise, 1e-4);
}

TEST_P(ClothPinnedAtABody, HangsFromTheAxisOfAPole) {
  World world({.max_step = step()});
  world.add_body({.shape = Cylinder{0.02, 3}, .motion = MotionType::static_body});
  const effects::GridSize size{1, 0.6, 20, 12};
  const Quat upright(Eigen::AngleAxis<Real>(std::numbers::pi / 2, Vec3::UnitX()));
  ClothDef def = cotton(size, {Vec3(0.5, 1, 0), upright}, integrator());
  for (uint32_t row = 0; row <= size.rows; ++row) pin(def, effects::grid_vertex(size, 0, row));
  const ClothHandle cloth = world.add_cloth(def);
  const ContactRecord record = run(world, cloth, step(), 0.5);
  EXPECT_LT(record.strain, 0.04);
  EXPECT_LT(record.rise, 1e-3);
}

TEST_P(ClothPinnedAtABody, LiesStillOnATableOfItsSize) {
  World world({.max_step = step()});
  world.add_body(
      {.shape = Box{Vec3(1, 0.1, 1)}, .motion = MotionType::static_body, .pose = {Vec3(0, -0.05, 0)}});
  const effects::GridSize size{1, 1, 20, 20};
  ClothDef def = cotton(size, {}, integrator());
  for (const uint32_t row : {0u, size.rows})
    for (const uint32_t column : {0u, size.columns}) pin(def, effects::grid_vertex(size, column, row));
  const ClothHandle cloth = world.add_cloth(def);
  const ContactRecord record = run(world, cloth, step(), 0.25);
  EXPECT_LT(record.strain, 0.003);
  EXPECT_LT(record.last_speed, 0.01);
  // Beside the corners, the cloth keeps its distance from the table.
  for (uint32_t i = 0; i < def.vertices.size(); ++i) {
    if (std::ranges::any_of(def.pins, [&](const ClothPin& p) { return p.vertex == i; })) continue;
    EXPECT_GT(world.cloth(cloth).points[i].y(), 0.9 * kThickness) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Integrators, ClothPinnedAtABody,
                         testing::Combine(testing::Values(ClothIntegrator::relaxed,
                                                          ClothIntegrator::implicit),
                                          testing::Values(1.0 / 240, 1.0 / 60)));

// Each cell lies over several vertices of the torus.
TEST(ClothOnATorus, ComesToRest) {
  for (const uint32_t cells : {10u, 20u}) {
    World world({.max_step = 1.0 / 60});
    const MeshHandle mesh = world.add_compound({solid_mesh(Torus{0.4, 0.1})});
    world.add_body({.shape = MeshShape{mesh}, .motion = MotionType::static_body});
    const ClothHandle cloth =
        world.add_cloth(cotton({1, 1, cells, cells}, {Vec3(0.013, 0.2, 0.007)}, ClothIntegrator::relaxed));
    const ContactRecord record = run(world, cloth, 1.0 / 60, 3);
    EXPECT_LT(record.strain, 0.01) << cells;
    EXPECT_LT(record.rise, 1e-3) << cells;
    EXPECT_LT(record.last_speed, 0.1) << cells;  // it vibrated at 5 m/s
  }
}

// The tip lies on a triangle whose corners stretch the cloth to its limit.
TEST(ClothUnderACone, CatchesTheTip) {
  for (const Real step : {1.0 / 240, 1.0 / 60})
    for (const ClothIntegrator integrator : {ClothIntegrator::relaxed, ClothIntegrator::implicit}) {
      World world({.max_step = step});
      const Quat down(Eigen::AngleAxis<Real>(175 * std::numbers::pi / 180, Vec3::UnitX()));
      const BodyHandle cone =
          world.add_body({.shape = Cone{0.1, 0.3}, .pose = {Vec3(0.02, 0.4, 0.03), down}, .mass = 0.5});
      const effects::GridSize size{1, 1, 20, 20};
      ClothDef def = cotton(size, {}, integrator);
      for (uint32_t row = 0; row <= size.rows; ++row)
        for (uint32_t column = 0; column <= size.columns; ++column)
          if (row == 0 || column == 0 || row == size.rows || column == size.columns)
            pin(def, effects::grid_vertex(size, column, row));
      const ClothHandle cloth = world.add_cloth(def);
      EXPECT_LT(run(world, cloth, step, 1.5).rise, 0.01) << step;  // of 2.3 J
      EXPECT_GT(world.body(cone).pose.position.y(), -0.15) << step;
    }
}

/// Shape, mass of the body [kg], mass of the cloth per area [kg/m^2], sub-steps per second, integrator.
class LightBodyUnderCloth
    : public testing::TestWithParam<std::tuple<Shape, Real, Real, int, ClothIntegrator>> {
 protected:
  static constexpr Real kHalf = 0.05;
  static BodyDef light(const Shape& shape, Real mass, const Vec3& at) {
    return {.shape = shape, .pose = {at}, .mass = mass, .friction = 0.5};
  }
  static ClothDef falling(Real density, Real height, ClothIntegrator integrator) {
    effects::Fabric fabric = effects::find_fabric("cotton")->fabric;
    fabric.areal_density = density;
    ClothDef def = effects::grid_cloth({1, 1, 14, 14}, {Vec3(0, height, 0)}, fabric);
    def.integrator = integrator;
    return def;
  }
};

TEST_P(LightBodyUnderCloth, StaysOnTheGround) {
  // If the body could move freely within the sub-step of the cloth, the cloth would push it into the ground
  // by F h^2 / m.
  const auto& [shape, mass, density, rate, integrator] = GetParam();
  World world({.max_step = 1.0 / rate});
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .friction = 0.5});
  const BodyHandle body = world.add_body(light(shape, mass, Vec3(0, kHalf, 0)));
  world.add_cloth(falling(density, 0.3, integrator));
  const Real start = world.energy().total();
  for (int i = 0; i < 60; ++i) {
    world.step(1.0 / 60);
    ASSERT_GT(world.body(body).pose.position.y(), kHalf - 1e-3) << i;
    ASSERT_LE(world.energy().total(), 1.001 * start) << i;
  }
  EXPECT_LT(std::abs(world.body(body).velocity.y()), 1e-3);
}

INSTANTIATE_TEST_SUITE_P(
    Bodies, LightBodyUnderCloth,
    testing::Combine(testing::Values(Shape(Sphere{0.05}), Shape(Box{Vec3(0.1, 0.1, 0.1)})),
                     testing::Values(0.02, 0.3, 2), testing::Values(0.1, 3), testing::Values(60, 240),
                     testing::Values(ClothIntegrator::relaxed, ClothIntegrator::implicit)));

// A box that carries cloth by pins, or under a blanket, stays on a ramp inside its friction cone.
TEST(LoadedBodies, StayOnARampWithTheirCloth) {
  const Quat slope(Eigen::AngleAxisd(-20 * std::numbers::pi / 180, Vec3::UnitZ()));
  for (const bool pinned : {true, false})
    for (const SolverKind solver : {SolverKind::automatic, SolverKind::fast})
      for (const int rate : {60, 240}) {
        World world({.max_step = 1.0 / rate, .solver = solver, .sleep = false});
        world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .pose = {Vec3::Zero(), slope}});
        const Vec3 place = slope * Vec3(0, 0.1, 0);
        const BodyHandle box =
            world.add_body({.shape = Box{Vec3(0.6, 0.2, 0.6)}, .pose = {place, slope}, .mass = 1});
        effects::Fabric fabric = effects::find_fabric("cotton")->fabric;
        fabric.areal_density = 4;
        ClothDef def = effects::grid_cloth({0.5, 0.5, 4, 4}, {slope * Vec3(0, 0.206, 0), slope}, fabric);
        def.air.density = 0;
        def.friction = 5;
        if (pinned)
          for (uint32_t i = 0; i < def.vertices.size(); ++i)
            def.pins.push_back(
                {.vertex = i, .body = box, .position = slope.conjugate() * (def.vertices[i] - place)});
        world.add_cloth(def);
        for (int i = 0; i < 2 * rate; ++i) world.step(1.0 / rate);
        EXPECT_LT((world.body(box).centre - place).norm(), 2e-4) << pinned << " " << rate;
      }
}

TEST(LightBodiesUnderCloth, FallAsleepInAStack) {
  for (const int rate : {60, 240}) {
    World world({.max_step = 1.0 / rate});
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .friction = 0.5});
    std::vector<BodyHandle> boxes;
    for (const Real height : {0.05, 0.15})
      boxes.push_back(world.add_body(
          {.shape = Box{Vec3(0.1, 0.1, 0.1)}, .pose = {Vec3(0, height, 0)}, .mass = 0.05, .friction = 0.5}));
    effects::Fabric fabric = effects::find_fabric("cotton")->fabric;
    fabric.areal_density = 1;
    world.add_cloth(effects::grid_cloth({1, 1, 14, 14}, {Vec3(0, 0.4, 0)}, fabric));
    for (int i = 0; i < 4 * 60; ++i) world.step(1.0 / 60);
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      EXPECT_TRUE(world.is_asleep(boxes[k])) << rate;
      EXPECT_NEAR(world.body(boxes[k]).pose.position.y(), 0.05 + 0.1 * static_cast<Real>(k), 2e-4) << rate;
    }
  }
}

TEST(LightBodiesUnderCloth, KeepTheirMomentum) {
  // A cloth is thrown onto a free box that lies on another free box. Each box gets its impulse at once.
  for (const ClothIntegrator integrator : {ClothIntegrator::relaxed, ClothIntegrator::implicit}) {
    World world({.gravity = Vec3::Zero(), .max_step = 1.0 / 60, .sleep = false});
    const Real mass = 0.05;
    const BodyHandle lower = world.add_body(
        {.shape = Box{Vec3(0.3, 0.1, 0.3)}, .pose = {Vec3(0, 0.05, 0)}, .mass = mass, .friction = 0.5});
    const BodyHandle upper = world.add_body(
        {.shape = Box{Vec3(0.1, 0.1, 0.1)}, .pose = {Vec3(0, 0.15, 0)}, .mass = mass, .friction = 0.5});
    effects::Fabric fabric = effects::find_fabric("cotton")->fabric;
    fabric.areal_density = 1;
    ClothDef def = effects::grid_cloth({1, 1, 14, 14}, {Vec3(0, 0.3, 0)}, fabric);
    def.air.density = 0;
    def.velocity = Vec3(0, -3, 0);
    def.integrator = integrator;
    const ClothHandle cloth = world.add_cloth(def);
    const auto momentum = [&] {
      Vec3 sum = mass * (world.body(lower).velocity + world.body(upper).velocity);
      for (std::size_t k = 0; k < def.masses.size(); ++k)
        sum += def.masses[k] * world.cloth(cloth).velocities[k];
      return sum;
    };
    const Vec3 whole = momentum();
    const Real start = world.energy().total();
    for (int i = 0; i < 60; ++i) {
      world.step(1.0 / 60);
      ASSERT_LE((momentum() - whole).norm(), 1e-9 * whole.norm()) << i;
      ASSERT_LE(world.energy().total(), 1.001 * start) << i;
    }
    EXPECT_LT(world.body(lower).velocity.y(), -1);
  }
}

}  // namespace
}  // namespace offstage::sim
