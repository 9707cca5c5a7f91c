#include "sim/world.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tests/meshes.h"

namespace offstage::sim {
namespace {

TEST(World, RefusesInvalidDefinitionsWithAReason) {
  World world;
  const auto message = [&](const BodyDef& def) {
    try {
      world.add_body(def);
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_NE(message({.name = "b", .shape = Sphere{-1}}).find("body \"b\": radius"), std::string::npos);
  EXPECT_NE(message({.density = 0}).find("density"), std::string::npos);
  EXPECT_NE(message({.shape = Plane{}}).find("no volume"), std::string::npos);
  TriangleMesh open = box_mesh(Vec3::Ones());
  open.triangles.pop_back();
  const MeshHandle mesh = world.add_mesh(open);
  EXPECT_NE(message({.shape = MeshShape{mesh}}).find("3 border edges"), std::string::npos);
  EXPECT_EQ(message({.shape = MeshShape{mesh}, .motion = MotionType::static_body}), "");
  EXPECT_THROW(world.add_mesh({{Vec3::Zero()}, {{0, 0, 1}}}), std::invalid_argument);
  EXPECT_THROW(world.add_mesh({}), std::invalid_argument);
}

TEST(World, TimeIsExactAfterManySteps) {
  World world;
  for (int i = 0; i < 6000; ++i) world.step(1.0 / 60);
  EXPECT_EQ(world.time(), 6000 * (1.0 / 60));
}

TEST(World, UsesTheFewestEqualSubSteps) {
  World world({.max_step = 1.0 / 240});
  EXPECT_EQ(world.step(1.0 / 60).substeps, 4u);
  EXPECT_EQ(world.step(1.0 / 24).substeps, 10u);
  EXPECT_EQ(world.step(1.0 / 50).substeps, 5u);
  EXPECT_EQ(world.step(1.0 / 1000).substeps, 1u);
}

TEST(World, ReportsOnlyMovedObjects) {
  World world;
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .pose = {Vec3(0, -50, 0)}});
  const auto still = world.add_body({.motion = MotionType::kinematic});
  const auto wheel = world.add_body(
      {.motion = MotionType::kinematic, .pose = {Vec3(5, 0, 0)}, .track = {.spin = {0, 1, 0}}});
  const auto ball = world.add_body({.pose = {Vec3(-5, 0, 0)}});
  world.step(1.0 / 60);
  ASSERT_EQ(world.moved().size(), 2u);
  EXPECT_EQ(world.moved()[0].body, wheel);
  EXPECT_EQ(world.moved()[1].body, ball);
  world.remove(ball);
  EXPECT_EQ(world.moved().size(), 1u);
  EXPECT_TRUE(world.remove(still));
  EXPECT_FALSE(world.remove(still));
}

TEST(World, AConeFallsAboutItsCentreOfMass) {
  World world;
  const auto cone = world.add_body({.shape = Cone{0.5, 1}, .angular_velocity = {3, 0, 0}});
  EXPECT_EQ(world.body(cone).centre, Vec3(0, -0.25, 0));
  for (int i = 0; i < 60; ++i) world.step(1.0 / 60);
  EXPECT_NEAR((world.body(cone).centre - Vec3(0, -0.25 - 9.81 / 2, 0)).norm(), 0, 1e-9);
  EXPECT_NEAR((world.body(cone).pose.point_to_world({0, -0.25, 0}) - world.body(cone).centre).norm(), 0,
              1e-12);
}

TEST(World, ContactsExcludeNonCollidingAndScriptedPairs) {
  World world({.sleep = false});
  const auto ground = world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  world.add_body({.shape = Box{}, .motion = MotionType::kinematic});
  world.add_body({.shape = Box{}, .motion = MotionType::static_body, .pose = {Vec3(0.5, 0, 0)}});
  const auto ball = world.add_body({.shape = Sphere{0.5}, .pose = {Vec3(4, 1, 0)}, .restitution = 0});
  world.add_body({.shape = Sphere{0.5}, .pose = {Vec3(4, 0, 0)}, .collides = false});
  for (int i = 0; i < 60; ++i) world.step(1.0 / 60);
  const auto contacts = world.contacts();
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_TRUE(contacts[0].a == ball && contacts[0].b == ground);
  const Real weight = 9.81 * world.body(ball).mass;
  EXPECT_NEAR((contacts[0].force - Vec3(0, weight, 0)).norm(), 0, 1e-6 * weight);
  EXPECT_NEAR(world.body(ball).pose.position.y(), 0.5, 2e-5);
}

TEST(World, AFastBodyDoesNotPassAThinOneBetweenSteps) {
  for (const SolverKind solver : {SolverKind::exact, SolverKind::fast, SolverKind::automatic})
    for (const Real speed : {20.0, 100.0, 300.0}) {
      World world({.gravity = Vec3::Zero(), .solver = solver});
      world.add_body({.shape = Box{{0.02, 1, 1}}, .motion = MotionType::static_body});
      const auto ball = world.add_body(
          {.shape = Sphere{0.01}, .pose = {Vec3(-0.5, 0.013, 0)}, .velocity = {speed, 0.1, 0}});
      for (int i = 0; i < 60; ++i) world.step(1.0 / 60);
      EXPECT_LT(world.body(ball).pose.position.x(), -0.019) << speed << " m/s";
    }
}

TEST(World, IslandsAreBodiesConnectedByContactsOrSprings) {
  World world;
  const auto ground = world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  std::vector<BodyHandle> boxes;
  for (const Real x : {0.0, 2.0, 4.0, 6.0})
    boxes.push_back(world.add_body({.shape = Box{}, .pose = {Vec3(x, 0.5, 0)}, .restitution = 0}));
  const auto rider = world.add_body({.shape = Box{}, .pose = {Vec3(2, 1.5, 0)}, .restitution = 0});
  world.add_spring({.a = BodyPoint{boxes[2]}, .b = BodyPoint{boxes[3]}});
  EXPECT_EQ(world.step(1.0 / 60).bodies.islands, 3u);
  EXPECT_EQ(world.island(boxes[1]), world.island(rider));
  EXPECT_EQ(world.island(boxes[2]), world.island(boxes[3]));
  EXPECT_NE(world.island(boxes[0]), world.island(boxes[1]));
  EXPECT_FALSE(world.island(ground).has_value());
}

TEST(World, ContactRulesReplaceTheSurfacesCoefficients) {
  const auto slide = [](bool ruled) {
    World world({.sleep = false});
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .material = "ice", .friction = 0.5});
    const auto box = world.add_body({.shape = Box{},
                                     .pose = {Vec3(0, 0.5, 0)},
                                     .velocity = {1, 0, 0},
                                     .material = "steel",
                                     .restitution = 0});
    if (ruled) world.add_contact_rule({.a = "steel", .b = "ice", .restitution = 0, .friction = 0});
    for (int i = 0; i < 60; ++i) world.step(1.0 / 60);
    return world.body(box).velocity.x();
  };
  EXPECT_NEAR(slide(false), 0, 1e-6);
  EXPECT_NEAR(slide(true), 1, 1e-9);
}

TEST(World, FreezesAndReportsABodyThatLeaves) {
  World world({.bounds = Aabb(Vec3::Constant(-2), Vec3::Constant(2))});
  const auto ball = world.add_body({.name = "ball"});
  int retired = 0;
  for (int i = 0; i < 120; ++i) retired += static_cast<int>(world.step(1.0 / 60).bodies_retired.size());
  EXPECT_EQ(retired, 1);
  EXPECT_TRUE(world.moved().empty());
  EXPECT_NEAR(world.body(ball).pose.position.y(), -2, 0.1);
}

TEST(World, NamesNonFiniteObjectsAndStaysUsable) {
  World world({.max_step = 0.1});
  const auto a =
      world.add_body({.name = "stiff", .shape = Sphere{0.1}, .pose = {Vec3(1, 0, 0)}, .mass = 1e-40});
  world.add_spring({.a = BodyPoint{a}, .b = WorldPoint{}, .stiffness = 1e300, .rest_length = 0});
  const StepReport report = world.step(0.1);
  EXPECT_FALSE(report.finite);
  EXPECT_EQ(report.non_finite.object, "stiff");
  EXPECT_EQ(report.non_finite.position_before, Vec3(1, 0, 0));
  EXPECT_FALSE(report.non_finite.position.allFinite() && report.non_finite.velocity.allFinite());
  EXPECT_TRUE(world.body(a).pose.position.allFinite());
  EXPECT_TRUE(world.step(0.1).finite);

  const auto system = world.add_particle_system({.name = "dust"});
  world.add_particle(system, {.velocity = {std::numeric_limits<Real>::quiet_NaN(), 0, 0}});
  const NonFinite lost = world.step(0.1).non_finite;
  EXPECT_EQ(lost.object, "dust");
  EXPECT_EQ(lost.particle, 0u);
  EXPECT_TRUE(std::isnan(lost.velocity.x()));
  EXPECT_EQ(world.particle_count(), 0u);
}

TEST(World, RemovalTakesSpringsAlongAndKeepsTheOrderOfParticles) {
  World world({.gravity = Vec3::Zero()});
  const auto system = world.add_particle_system({});
  for (int i = 0; i < 10; ++i)
    world.add_particle(system, {.position = {Real(i), 0, 0}, .lifespan = i % 3 == 0 ? 0.05 : 1e30});
  const auto dying = world.add_spring({.a = ParticlePoint{system, 3}, .b = WorldPoint{}, .stiffness = 0});
  const auto living = world.add_spring({.a = ParticlePoint{system, 4}, .b = WorldPoint{}, .stiffness = 0});
  const StepReport first = world.step(0.04), second = world.step(0.04);
  EXPECT_EQ(first.particles.born, 10u);
  EXPECT_EQ(first.particles.expired, 0u);
  EXPECT_EQ(second.particles.expired, 4u);
  EXPECT_EQ(world.particles(system).id, (std::vector<uint64_t>{1, 2, 4, 5, 7, 8}));
  EXPECT_FALSE(world.remove(dying));
  EXPECT_TRUE(world.remove(living));
}

TEST(World, ANewParticleIsIntegratedOverItsPartOfTheSubStep) {
  World world({.gravity = Vec3::Zero(), .max_step = 0.1});
  const auto system = world.add_particle_system({});
  world.step(0.2, [&](Real start, Real) {
    if (start == 0) world.add_particle(system, {.velocity = {1, 0, 0}}, 0.03);
  });
  EXPECT_NEAR(world.particles(system).position[0].x(), 0.13, 1e-15);
  EXPECT_NEAR(world.particles(system).age[0], 0.13, 1e-15);
}

/// The same equation of motion as a separate DynamicSystem.
class DragAndGravity final : public DynamicSystem {
 public:
  void velocity(Real, std::span<const Real>, std::span<const Real> p, std::span<Real> dx) const override {
    std::copy(p.begin(), p.end(), dx.begin());
  }
  void force(Real, std::span<const Real>, std::span<const Real> p, std::span<Real> dp) const override {
    constexpr std::array<Real, 3> kGravity = {0, -9.81, 0}, kForce = {0.1, 0, 0}, kWind = {1, 0, 2};
    for (std::size_t i = 0; i < 3; ++i)
      dp[i] = kGravity[i] + (kForce[i] - 0.3 * (p[i] - kWind[i])) * (1 / 0.7);
  }
};

TEST(World, ParticlesMoveExactlyAsTheIntegrator) {
  for (auto kind : {IntegratorKind::explicit_euler, IntegratorKind::symplectic_euler,
                    IntegratorKind::midpoint, IntegratorKind::rk4}) {
    World world({.wind = {1, 0, 2}, .max_step = 1});
    const auto system =
        world.add_particle_system({.linear_drag = 0.3, .force = {0.1, 0, 0}, .integrator = kind});
    world.add_particle(system, {.velocity = {3, 2, 1}, .mass = 0.7});
    std::array<Real, 3> x = {0, 0, 0}, p = {3, 2, 1};
    IntegratorWorkspace work;
    for (int i = 0; i < 50; ++i) {
      world.step(0.125);
      integrator(kind).step(DragAndGravity(), 0, 0.125, x, p, work);
    }
    EXPECT_EQ(world.particles(system).position[0], Vec3(x[0], x[1], x[2]));
    EXPECT_EQ(world.particles(system).velocity[0], Vec3(p[0], p[1], p[2]));
  }
}

TEST(StateHash, SeesEveryBitAndPrintsThemAll) {
  const auto hash = [](Real x) {
    World world;
    world.add_body({.pose = {Vec3(x, 0, 0)}});
    return world.state_hash();
  };
  EXPECT_EQ(hash(1), hash(1));
  EXPECT_NE(hash(1), hash(std::nextafter(1.0, 2.0)));
  EXPECT_EQ((StateHash{.low = 0x0123456789abcdef, .high = 0xfedcba9876543210}).hex(),
            "fedcba98765432100123456789abcdef");
}

}  // namespace
}  // namespace offstage::sim
