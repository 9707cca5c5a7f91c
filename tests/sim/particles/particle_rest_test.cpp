/// Resting contact of particles, and their effect on bodies.

#include <gtest/gtest.h>

#include "sim/world.h"
#include "tests/random.h"

namespace offstage::sim {
namespace {

constexpr Real kRestFrame = 1.0 / 60;

Vec3 total_momentum(const World& world) {
  Vec3 sum = Vec3::Zero();
  world.for_each_particle_system([&](ParticleSystemHandle system) {
    const ParticleArrays& p = world.particles(system);
    for (std::size_t i = 0; i < p.size(); ++i) sum += p.mass[i] * p.velocity[i];
  });
  world.for_each_body([&](BodyHandle body) { sum += world.body(body).mass * world.body(body).velocity; });
  return sum;
}

void add_tray(World& world, const Vec3& size, Real friction) {
  world.add_body(
      {.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0, .friction = friction});
  for (int axis : {0, 2})
    for (Real side : {-1.0, 1.0}) {
      Vec3 wall = size;
      wall[axis] = 0.1;
      BodyDef def{
          .shape = Box{wall}, .motion = MotionType::static_body, .restitution = 0, .friction = friction};
      def.pose.position = Vec3(0, size.y() / 2, 0) + side * (size[axis] / 2 + 0.05) * Vec3::Unit(axis);
      world.add_body(def);
    }
}

Real greatest_overlap(const ParticleArrays& p) {
  Real overlap = 0;
  for (std::size_t i = 0; i < p.size(); ++i)
    for (std::size_t j = i + 1; j < p.size(); ++j)
      overlap = std::max(overlap, p.radius[i] + p.radius[j] - (p.position[i] - p.position[j]).norm());
  return overlap;
}

class ParticleStack : public testing::TestWithParam<ParticleContactMethod> {};

TEST_P(ParticleStack, OfTenBeadsStandsAndItsForcesSumUp) {
  World world({.max_step = kRestFrame, .particle_contacts = GetParam()});
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0});
  const auto system = world.add_particle_system({.internal = true});
  for (int i = 0; i < 10; ++i)
    world.add_particle(system,
                       {.position = {0, 0.01 + 0.02 * i, 0}, .mass = 0.1 + 0.1 * (i % 3), .restitution = 0});
  ContactWork work;
  for (int i = 0; i < 300; ++i) work.add(world.step(kRestFrame).solvers.particle_lcp);
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_NEAR(world.particles(system).velocity[i].norm(), 0, 1e-6);
    EXPECT_NEAR(world.particles(system).position[i].y(), 0.01 + 0.02 * Real(i), 5e-4);
    EXPECT_NEAR(world.particles(system).position[i].x(), 0, 1e-9);
  }
  const bool by_lcp = GetParam() == ParticleContactMethod::lcp;
  EXPECT_EQ(work.solves, by_lcp ? 300u : 0u);
  EXPECT_EQ(work.iterations > 0, by_lcp);
  EXPECT_EQ(work.fallbacks, 0u);
}
INSTANTIATE_TEST_SUITE_P(Methods, ParticleStack,
                         testing::Values(ParticleContactMethod::relaxation, ParticleContactMethod::lcp));

// A cluster of more contacts than the limit is solved by relaxation, to the same bits, and counted.
TEST(ParticleRest, RelaxationTakesOverLargeClusters) {
  const auto state = [](ParticleContactMethod method, ContactWork& work) {
    World world({.max_step = kRestFrame, .particle_contacts = method, .particle_cluster = 9});
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0});
    const auto system = world.add_particle_system({.internal = true});
    for (int i = 0; i < 10; ++i)
      world.add_particle(system, {.position = {0, 0.01 + 0.02 * i, 0}, .mass = 0.1, .restitution = 0});
    for (int i = 0; i < 20; ++i) work.add(world.step(kRestFrame).solvers.particle_lcp);
    return world.state_hash().hex();
  };
  ContactWork lcp, relaxed;
  EXPECT_EQ(state(ParticleContactMethod::lcp, lcp), state(ParticleContactMethod::relaxation, relaxed));
  EXPECT_EQ(lcp.solves, 20u);
  EXPECT_EQ(lcp.fallbacks, 20u);
}

// Without other particles, a particle is a cluster with its contacts. It slides down an incline as by
// Coulomb's law along a tangent of the contact's frame.
TEST(ParticleRest, SlidesDownAnInclineByPivotingAsByRelaxation) {
  for (const ParticleContactMethod method : {ParticleContactMethod::relaxation, ParticleContactMethod::lcp}) {
    World world({.max_step = kRestFrame, .particle_contacts = method});
    constexpr Real kAngle = 0.6, kMu = 0.3;
    const Quat tilt(Eigen::AngleAxisd(-kAngle, Vec3::UnitZ()));
    world.add_body({.shape = Plane{},
                    .motion = MotionType::static_body,
                    .pose = {Vec3::Zero(), tilt},
                    .restitution = 0,
                    .friction = kMu});
    const auto system = world.add_particle_system({.internal = true});
    const Vec3 start = tilt * Vec3(0, 0.01, 0);
    world.add_particle(system, {.position = start, .mass = 0.1, .restitution = 0, .friction = kMu});
    for (int i = 0; i < 240; ++i) world.step(kRestFrame);
    const Real t = 240 * kRestFrame,
               expected = 9.81 * (std::sin(kAngle) - kMu * std::cos(kAngle)) * t * t / 2;
    EXPECT_NEAR((world.particles(system).position[0] - start).norm() / expected, 1, 0.02);
  }
}

// On planks, particles slide twice as far along the friction axis as across it: v^2 / (2 mu g) with either
// coefficient.
TEST(ParticleRest, SlidesByTheFrictionAlongAndAcrossTheFrictionAxis) {
  for (bool internal : {false, true}) {
    World world;
    world.add_body({.shape = Plane{},
                    .motion = MotionType::static_body,
                    .restitution = 0,
                    .friction = 0.1,
                    .cross_friction = 0.4,
                    .friction_axis = Vec3(0, 0, 3)});
    const auto system = world.add_particle_system({.internal = internal});
    for (const Vec3& v : {Vec3(2, 0, 0), Vec3(0, 0, -2)})
      world.add_particle(
          system,
          {.position = v.normalized() + Vec3(0, 0.01, 0), .velocity = v, .restitution = 0, .friction = 0.4});
    for (int i = 0; i < 120; ++i) world.step(kRestFrame);
    const auto& at = world.particles(system).position;
    const Real across = 4 / (2 * 0.4 * 9.81), along = 4 / (2 * 0.2 * 9.81);
    EXPECT_NEAR(at[0].x(), 1 + across, 0.01 * across) << internal;
    EXPECT_NEAR(at[1].z(), -1 - along, 0.01 * along) << internal;
    EXPECT_NEAR(world.particles(system).velocity[0].norm(), 0, 1e-9);
  }
}

/// A heap to which a loose column of sand has collapsed. The particles do not rotate, so a regular lattice
/// would not collapse.
struct Heap {
  Real slope, kinetic_energy_each, overlap;
};
Heap heap(Real friction, int frames) {
  World world({.max_step = 1.0 / 120});
  world.add_body(
      {.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0, .friction = friction});
  const auto system = world.add_particle_system({.internal = true});
  const Scatter random{2};
  uint64_t k = 0;
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 8; ++x)
      for (int z = 0; z < 8; ++z, ++k)
        world.add_particle(system, {.position = {0.03 * x + 0.01 * random.uniform(k, 0), 0.0105 + 0.0205 * y,
                                                 0.03 * z + 0.01 * random.uniform(k, 1)},
                                    .mass = 0.01,
                                    .radius = 0.01 - 0.0005 * random.uniform(k, 2),
                                    .restitution = 0,
                                    .friction = friction});
  for (int i = 0; i < frames; ++i) world.step(kRestFrame);
  const ParticleArrays& p = world.particles(system);
  Vec3 centre = Vec3::Zero();
  for (const Vec3& x : p.position) centre += x / static_cast<Real>(p.size());
  // For a cone with slope s and radius R, the mean height is s R / 4 and the mean distance from the axis R /
  // 2.
  Real height = 0, distance = 0, energy = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vec3 d = p.position[i] - centre;
    height += (p.position[i].y() - p.radius[i]) / static_cast<Real>(p.size());
    distance += std::hypot(d.x(), d.z()) / static_cast<Real>(p.size());
    energy += p.velocity[i].squaredNorm() / 2 / static_cast<Real>(p.size());
  }
  return {2 * height / distance, energy, greatest_overlap(p)};
}

TEST(LongParticleRest, AHeapComesToRestAndIsSteeperWithMoreFriction) {
  const Heap slippery = heap(0, 240), sand = heap(0.3, 240), rough = heap(0.6, 240);
  EXPECT_LT(slippery.slope, 0.02);
  EXPECT_GT(sand.slope, 0.2);
  EXPECT_LT(sand.slope, 0.5);
  EXPECT_GT(rough.slope, 1.3 * sand.slope);
  EXPECT_LT(rough.slope, 1.5);
  for (const Heap& h : {sand, rough}) {
    EXPECT_LT(h.kinetic_energy_each, 1e-8);
    EXPECT_LT(h.overlap, 0.05 * 0.01);
  }
}

TEST(ParticleRest, BeadsInATrayWeighOnTheBodyBeneathThem) {
  World world({.sleep = false});
  add_tray(world, {0.2, 0.4, 0.2}, 0);
  const auto plate = world.add_body({.shape = Box{{0.19, 0.02, 0.19}},
                                     .pose = {Vec3(0, 0.01, 0)},
                                     .mass = 2,
                                     .restitution = 0,
                                     .friction = 0});
  const auto system = world.add_particle_system({.internal = true});
  constexpr int kCount = 180;
  for (int i = 0; i < kCount; ++i)
    world.add_particle(system, {.position = {0.025 * (i % 6) - 0.0625, 0.04 + 0.025 * (i / 36),
                                             0.025 * (i / 6 % 6) - 0.0625},
                                .mass = 0.01,
                                .radius = 0.012,
                                .restitution = 0,
                                .friction = 0.3});
  for (int i = 0; i < 240; ++i) world.step(kRestFrame);
  // The plate presses on the ground with its own weight and that of the beads.
  Real weight = 0;
  constexpr int kSamples = 60;
  for (int i = 0; i < kSamples; ++i) {
    world.step(kRestFrame);
    for (const ContactState& c : world.contacts()) weight += (c.a == plate ? 1 : -1) * c.force.y() / kSamples;
  }
  EXPECT_NEAR(weight - 2 * 9.81, kCount * 0.01 * 9.81, 0.01 * kCount * 0.01 * 9.81);
}

TEST(ParticleBodies, AJetOnABoxKeepsMomentumAndWakesIt) {
  for (const bool internal : {false, true}) {
    World world({.gravity = Vec3::Zero()});
    const auto box = world.add_body({.shape = Box{{0.3, 0.3, 0.3}}, .mass = 2, .restitution = 0.3});
    for (int i = 0; i < 60; ++i) world.step(kRestFrame);
    EXPECT_TRUE(world.is_asleep(box));
    const auto jet = world.add_particle_system({.internal = internal});
    const Scatter random{8};
    Vec3 given = Vec3::Zero();
    for (int i = 0; i < 60; ++i) {
      for (uint64_t k = 0; k < 10; ++k) {
        const uint64_t at = uint64_t(i) * 10 + k;
        const Particle p{.position = {-1, 0.2 * random.uniform(at, 0), 0.2 * random.uniform(at, 1) - 0.1},
                         .velocity = {10 + random.uniform(at, 2), 0, 0},
                         .mass = 0.005};
        world.add_particle(jet, p);
        given += p.mass * p.velocity;
      }
      world.step(kRestFrame);
      ASSERT_NEAR((total_momentum(world) - given).norm(), 0, 1e-9 * given.norm());
    }
    EXPECT_FALSE(world.is_asleep(box));
    EXPECT_GT(world.body(box).velocity.x(), 1);
    EXPECT_LT(world.body(box).angular_velocity.z(), -0.1);  // the jet hits the box above its centre
  }
}

TEST(ParticleBodies, AHeavyParticleHitsALightBodyByTheEffectiveMass) {
  for (const bool internal : {false, true})
    for (Real e : {0.0, 0.5, 1.0}) {
      World world({.gravity = Vec3::Zero()});
      const auto ball = world.add_body({.shape = Sphere{0.5}, .mass = 1, .restitution = e, .friction = 0});
      const auto system = world.add_particle_system({.internal = internal});
      world.add_particle(
          system,
          {.position = {-1, 0, 0}, .velocity = {2, 0, 0}, .mass = 10, .restitution = e, .friction = 0});
      for (int i = 0; i < 30; ++i) world.step(kRestFrame);
      EXPECT_NEAR(world.body(ball).velocity.x(), 2 * (1 + e) * 10 / 11, 0.02);
      EXPECT_NEAR(world.particles(system).velocity[0].x(), 2 - 2 * (1 + e) / 11, 0.01);
    }
}

}  // namespace
}  // namespace offstage::sim
