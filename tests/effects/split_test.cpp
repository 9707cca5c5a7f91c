#include "effects/split.h"

#include <cmath>
#include <map>
#include <numbers>

#include <gtest/gtest.h>

#include "births.h"
#include "effects/worst_case.h"

namespace offstage::effects {
namespace {

using namespace sim;

/// One particle that flies along x at 10 m/s.
const Particle kParent{.position = {1, 2, 3},
                       .velocity = {10, 0, 0},
                       .mass = 0.8,
                       .radius = 0.1,
                       .lifespan = 100,
                       .restitution = 0.7,
                       .friction = 0.2,
                       .charge = 4e-6};

// Each split replaces one particle by 1 + count, whose remaining depth is one less: (1 + count)^depth
// particles at the end.
TEST(Split, ChildrenByDepth) {
  for (int depth = 0; depth <= 5; ++depth) {
    World world = empty_world();
    const auto system = world.add_particle_system({});
    world.add_particle(system, kParent);
    const SplitDef def{.count = 3.0, .age = 0.1, .delay = 0.05, .depth = depth, .radius_percent = 90.0};
    Splitter splitter(def, system, system);
    run(world, 1, 60, splitter);
    EXPECT_EQ(world.particle_count(), std::pow(4, depth));
    EXPECT_EQ(splitter.report().released + 1, worst_case(def, {1, 1, 100, 1}, true).alive + 1);
  }
}

// The parent splits at the ages 0.1, 0.15, 0.2 ... s; its children, in another system, are counted at each
// time.
TEST(Split, ChildrenByAgeAndDelay) {
  World world = empty_world();
  const auto parents = world.add_particle_system({}), children = world.add_particle_system({});
  world.add_particle(parents, kParent);
  Splitter splitter({.count = 2.0, .age = 0.1001, .delay = 0.05, .depth = 6}, parents, children);
  for (int frame = 1; frame <= 60; ++frame) {
    run(world, 1.0 / 60, 60, splitter);
    const int splits = std::clamp(static_cast<int>(std::floor((frame / 60.0 - 0.1001) / 0.05)) + 1, 0, 6);
    EXPECT_EQ(world.particles(children).size(), static_cast<std::size_t>(2 * splits)) << frame;
  }
}

TEST(Split, ADeadParentDoesNotSplit) {
  World world = empty_world();
  const auto system = world.add_particle_system({});
  Particle parent = kParent;
  parent.lifespan = 0.22;
  world.add_particle(system, parent);
  const SplitDef def{.count = 1.0, .age = 0.1, .delay = 0.05, .depth = 10, .lifespan_percent = 10.0};
  Splitter splitter(def, system, system);
  run(world, 1, 60, splitter);
  EXPECT_EQ(splitter.report().released, 3u);  // at 0.1, 0.15 and 0.2 s; children live for 0.022 s
  EXPECT_EQ(worst_case(def, {1, 1, 0.22, 1}, true).born, 3u);
}

TEST(Split, ChildrenInheritTheirPercentagesExactly) {
  World world = empty_world();
  const auto parents = world.add_particle_system({}), children = world.add_particle_system({});
  world.add_particle(parents, kParent);
  Splitter splitter({.count = 5.0,
                     .age = 0.1234,
                     .velocity_percent = 40.0,
                     .spread_deg = 25.0,
                     .radius_percent = 50.0,
                     .lifespan_percent = 20.0},
                    parents, children);
  run(world, 0.5, 24, splitter);
  const ParticleArrays& p = world.particles(children);
  ASSERT_EQ(p.size(), 5u);
  for (std::size_t i = 0; i < p.size(); ++i) {
    EXPECT_NEAR(p.velocity[i].norm(), 4, 1e-12);
    EXPECT_NEAR(p.velocity[i].x(), 4 * std::cos(25 * std::numbers::pi / 180), 1e-12);
    EXPECT_EQ(p.radius[i], 0.05);
    EXPECT_DOUBLE_EQ(p.mass[i], 0.1);  // density of the parent
    EXPECT_DOUBLE_EQ(p.charge[i], 0.5e-6);
    EXPECT_EQ(p.lifespan[i], 20);
    EXPECT_EQ(p.restitution[i], 0.7);
    EXPECT_EQ(p.friction[i], 0.2);
    EXPECT_NEAR(p.age[i], 0.5 - 0.1234, 1e-12);
    EXPECT_NEAR((p.position[i] - p.age[i] * p.velocity[i] - Vec3(2.234, 2, 3)).norm(), 0, 1e-12);
  }
}

// Children share the parent's mass, keep its speed and fly in directions all around it. Their total momentum
// is the momentum of the parent times the mean cosine of their angle.
TEST(Split, MomentumIsInherited) {
  World world = empty_world();
  const auto parents = world.add_particle_system({}), children = world.add_particle_system({});
  world.add_particle(parents, kParent);
  constexpr int kN = 100'000;
  Splitter splitter({.count = Real(kN), .age = 0.1, .spread_deg = 60.0, .mass_percent = 100.0 / kN}, parents,
                    children);
  run(world, 0.2, 60, splitter);
  const ParticleArrays& p = world.particles(children);
  Vec3 momentum = Vec3::Zero();
  Real mass = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    momentum += p.mass[i] * p.velocity[i];
    mass += p.mass[i];
  }
  EXPECT_NEAR(mass, 0.8, 1e-9);
  EXPECT_NEAR(momentum.x(), 0.8 * 10 * 0.5, 1e-9);
  const Real sideways = 0.8 * 10 * std::sin(std::numbers::pi / 3) / std::sqrt(2.0 * kN);
  EXPECT_NEAR(momentum.y(), 0, 3 * sideways);
  EXPECT_NEAR(momentum.z(), 0, 3 * sideways);
}

// Under gravity, children inherit the parent's velocity at the exact time of the split, also within a
// sub-step.
TEST(Split, InheritsTheVelocityOfItsTimeUnderGravity) {
  World world({.max_step = 1.0 / 24});
  const auto parents = world.add_particle_system({.integrator = IntegratorKind::midpoint}),
             children = world.add_particle_system({.integrator = IntegratorKind::midpoint});
  world.add_particle(parents, kParent);
  Splitter splitter({.count = 1.0, .age = 0.31}, parents, children);
  run(world, 1, 24, splitter);
  const ParticleArrays &a = world.particles(parents), &b = world.particles(children);
  ASSERT_EQ(b.size(), 1u);
  EXPECT_NEAR((a.position[0] - b.position[0]).norm(), 0, 1e-11);
  EXPECT_NEAR((a.velocity[0] - b.velocity[0]).norm(), 0, 1e-11);
}

// An emitter adds particles to the system of the children, so particle ids depend on the sub-steps. The
// random draws must not depend on them.
TEST(Split, IsTheSameAtAnyFrameRateAndSubStep) {
  const auto outcome = [](int fps, Real step) {
    World world = empty_world(step);
    const auto system = world.add_particle_system({});
    Emitter emitter(
        {.release = {.rate = 240.0, .end = 0.5}, .particles = {.speed = Normal{3, 1}, .lifespan = 1e9}},
        system);
    Splitter splitter({.count = Uniform{0, 3},
                       .age = Normal{0.2, 0.05},
                       .delay = Uniform{0.05, 0.1},
                       .depth = 3,
                       .velocity_percent = Normal{80, 20},
                       .spread_deg = Normal{0, 20},
                       .radius_percent = Normal{70, 10}},
                      system, system);
    run(world, 2, fps, emitter, splitter);
    std::map<Real, Birth> by_size;
    for (const Birth& b : births_of(world, system))
      if (b.radius < 0.01) by_size[b.radius] = b;
    return by_size;
  };
  const auto reference = outcome(24, 1.0 / 240);
  ASSERT_GT(reference.size(), 500u);
  for (const auto& [fps, step] : {std::pair(30, 1.0 / 240), {60, 1.0 / 240}, {60, 1.0 / 900}}) {
    const auto other = outcome(fps, step);
    ASSERT_EQ(other.size(), reference.size());
    for (auto a = reference.begin(), b = other.begin(); a != reference.end(); ++a, ++b) {
      ASSERT_EQ(a->first, b->first);
      ASSERT_NEAR((a->second.velocity - b->second.velocity).norm(), 0, 1e-11);
      ASSERT_NEAR((a->second.position - b->second.position).norm(), 0, 1e-9);
      ASSERT_NEAR(a->second.time, b->second.time, 1e-10);
    }
  }
}

TEST(Split, PercentagesHaveTheirMeansAndDeviations) {
  World world = empty_world();
  const auto parents = world.add_particle_system({}), children = world.add_particle_system({});
  world.add_particle(parents, kParent);
  constexpr int kN = 100'000;
  Splitter splitter({.count = Real(kN),
                     .age = 0.1,
                     .velocity_percent = Uniform{20, 80},
                     .radius_percent = Normal{.mean = 50, .deviation = 5, .min = 1, .clip = false},
                     .lifespan_percent = Uniform{50, 150}},
                    parents, children);
  run(world, 0.2, 60, splitter);
  const ParticleArrays& p = world.particles(children);
  ASSERT_EQ(p.size(), std::size_t{kN});
  Real speed = 0, radius = 0, lifespan = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    speed += p.velocity[i].norm() / kN;
    radius += p.radius[i] / kN;
    lifespan += p.lifespan[i] / kN;
  }
  EXPECT_NEAR(speed, 5, 3 * 6 / std::sqrt(12.0 * kN));
  EXPECT_NEAR(radius, 0.05, 3 * 0.005 / std::sqrt(kN));
  EXPECT_NEAR(lifespan, 100, 3 * 100 / std::sqrt(12.0 * kN));
}

TEST(Split, CanBeOffAndLimited) {
  World world = empty_world();
  const auto system = world.add_particle_system({});
  world.add_particle(system, kParent);
  Splitter off({.enabled = false}, system, system);
  Splitter limited({.count = 10.0, .age = 0.1, .delay = 0.1, .depth = 3, .max_alive = 8}, system, system);
  run(world, 1, 60, off, limited);
  EXPECT_EQ(off.report().triggered, 0u);
  EXPECT_EQ(world.particle_count(), 8u);
  EXPECT_GT(limited.report().skipped, 0u);
  EXPECT_THROW(Splitter({.age = 0.0}, system, system), std::invalid_argument);
  EXPECT_THROW(Splitter({.radius_percent = Normal{50, 60}}, system, system), std::invalid_argument);
}

}  // namespace
}  // namespace offstage::effects
