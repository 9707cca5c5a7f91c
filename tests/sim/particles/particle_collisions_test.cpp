/// Collisions between particles, each at its own time of impact.

#include "sim/particles/particle_collisions.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "sim/world.h"
#include "tests/random.h"

namespace offstage::sim {
namespace {

constexpr Real kFilmFrame = 1.0 / 60;

Vec3 momentum(const World& world) {
  Vec3 sum = Vec3::Zero();
  world.for_each_particle_system([&](ParticleSystemHandle system) {
    const ParticleArrays& p = world.particles(system);
    for (std::size_t i = 0; i < p.size(); ++i) sum += p.mass[i] * p.velocity[i];
  });
  return sum;
}

TEST(MeetingTime, IsTheRootOfTheDistanceOfMovingSpheres) {
  const Scatter random{3};
  int met = 0;
  for (uint64_t k = 0; k < 2000; ++k) {
    const auto vector = [&](uint64_t at) {
      return Vec3(random.uniform(k, at) - 0.5, random.uniform(k, at + 1) - 0.5,
                  random.uniform(k, at + 2) - 0.5);
    };
    const Vec3 d = 20 * vector(0), u = 600 * vector(3);
    const Real reach = 5 * random.uniform(k, 6);
    const auto t = meeting_time(d, u, reach);
    const Real nearest = d.cross(u).norm() / u.norm();
    ASSERT_EQ(t.has_value(), d.dot(u) < 0 && nearest <= reach);
    if (!t) continue;
    ++met;
    if (d.norm() > reach)
      ASSERT_NEAR((d + *t * u).norm(), reach, 1e-9);
    else
      ASSERT_EQ(*t, 0);
  }
  EXPECT_GT(met, 50);
}

TEST(ParticlePairs, HeadOnAndObliqueCollisionsHaveTheClosedForm) {
  for (Real e : {0.0, 0.5, 1.0})
    for (Real offset : {0.0, 0.012}) {
      World world({.gravity = Vec3::Zero()});
      const auto system = world.add_particle_system({.internal = true});
      const Real m1 = 0.3, m2 = 0.7, R = 0.02;
      world.add_particle(system, {.position = {-0.1, offset, 0},
                                  .velocity = {2, 0, 0},
                                  .mass = m1,
                                  .restitution = e,
                                  .friction = 0});
      world.add_particle(
          system,
          {.position = {0.1, 0, 0}, .velocity = {-1, 0, 0}, .mass = m2, .restitution = e, .friction = 0});
      for (int i = 0; i < 12; ++i) world.step(kFilmFrame);
      const Vec3 n = Vec3(-std::sqrt(R * R - offset * offset), offset, 0) / R;
      const Real P = (1 + e) * m1 * m2 / (m1 + m2) * -Vec3(3, 0, 0).dot(n);
      const auto& p = world.particles(system);
      EXPECT_NEAR((p.velocity[0] - (Vec3(2, 0, 0) + P / m1 * n)).norm(), 0, 1e-9);
      EXPECT_NEAR((p.velocity[1] - (Vec3(-1, 0, 0) - P / m2 * n)).norm(), 0, 1e-9);
      const Real meet = (0.2 - R * std::abs(n.x())) / 3, after = world.time() - meet;
      const Vec3 expected = Vec3(-0.1 + 2 * meet, offset, 0) + after * p.velocity[0];
      EXPECT_NEAR((p.position[0] - expected).norm(), 0, 1e-9);
    }
}

/// Simulates five particles in a row along x, of which the first `hitting` ones hit the others with 1 m/s.
/// Returns the velocities afterwards.
std::vector<Real> cradle(ImpactLaw law, int hitting) {
  World world({.gravity = Vec3::Zero(), .impact = law});
  const auto system = world.add_particle_system({.internal = true});
  for (int i = 0; i < 5; ++i) {
    const Real gap = i < hitting ? 0.005 : 0;
    world.add_particle(system, {.position = {0.02 * i - gap, 0, 0},
                                .velocity = {i < hitting ? 1.0 : 0, 0, 0},
                                .restitution = 1,
                                .friction = 0});
  }
  for (int i = 0; i < 3; ++i) world.step(kFilmFrame);
  std::vector<Real> v;
  for (const Vec3& velocity : world.particles(system).velocity) v.push_back(velocity.x());
  return v;
}

TEST(ParticlePairs, NewtonsCradleByBothImpactLaws) {
  for (int hitting : {1, 2}) {
    const std::vector<Real> v = cradle(ImpactLaw::sequential, hitting);
    for (int i = 0; i < 5; ++i) EXPECT_NEAR(v[static_cast<std::size_t>(i)], i >= 5 - hitting ? 1 : 0, 1e-9);
  }
  // With the simultaneous law, the first particle rebounds from the others as from one body of four times the
  // mass.
  const std::vector<Real> v = cradle(ImpactLaw::simultaneous, 1);
  EXPECT_NEAR(v[0], -0.6, 1e-9);
  for (std::size_t i = 1; i < 5; ++i) EXPECT_NEAR(v[i], 0.4, 1e-9);
}

World gas(ParticleSystemHandle& system, std::size_t count, Real e, Real friction) {
  World world({.gravity = Vec3::Zero()});
  system = world.add_particle_system({.collides = false, .internal = true});
  const Scatter random{5};
  for (uint64_t i = 0; i < count; ++i) {
    const auto at = [&](uint64_t k) { return random.uniform(i, k) - 0.5; };
    world.add_particle(system, {.position = Vec3(at(0), at(1), at(2)) * 0.6 + Vec3(0.1 * Real(i % 7), 0, 0),
                                .velocity = 6 * Vec3(at(3), at(4), at(5)),
                                .mass = 0.5 + random.uniform(i, 6),
                                .radius = 0.01 + 0.02 * random.uniform(i, 7),
                                .restitution = e,
                                .friction = friction});
  }
  return world;
}

TEST(ParticlePairs, AGasKeepsMomentumAndWithElasticCollisionsEnergy) {
  ParticleSystemHandle system;
  World elastic = gas(system, 300, 1, 0);
  elastic.step(kFilmFrame);  // particles that overlapped at the start separate
  const Real energy = elastic.energy().kinetic;
  const Vec3 before = momentum(elastic);
  uint64_t collisions = 0;
  for (int i = 0; i < 12; ++i) collisions += elastic.step(kFilmFrame).particles.collisions;
  EXPECT_GT(collisions, 100u);
  EXPECT_NEAR(elastic.energy().kinetic, energy, 1e-9 * energy);
  EXPECT_NEAR((momentum(elastic) - before).norm(), 0, 1e-10);

  World rough = gas(system, 300, 0.6, 0.4);
  const Vec3 first = momentum(rough);
  Real last = rough.energy().kinetic;
  for (int i = 0; i < 12; ++i) {
    rough.step(kFilmFrame);
    ASSERT_LE(rough.energy().kinetic, last * (1 + 1e-12));
    last = rough.energy().kinetic;
  }
  EXPECT_NEAR((momentum(rough) - first).norm(), 0, 1e-10);
}

TEST(ParticlePairs, FastParticlesInALineNeverPassEachOther) {
  // Rounding moves the particles off the line, and each collision multiplies the deviation by about the free
  // path over the radius. Smaller particles would eventually pass beside each other.
  World world({.gravity = Vec3::Zero()});
  const auto system = world.add_particle_system({.internal = true});
  const Scatter random{9};
  constexpr Real kRadius = 0.1;
  for (uint64_t i = 0; i < 60; ++i)
    world.add_particle(system, {.position = {0.3 * static_cast<Real>(i), 0, 0},
                                .velocity = {600 * (random.uniform(i, 0) - 0.5), 0, 0},
                                .mass = 0.2 + random.uniform(i, 1),
                                .radius = kRadius,
                                .restitution = random.uniform(i, 2)});
  uint64_t collisions = 0;
  for (int i = 0; i < 20; ++i) {
    collisions += world.step(kFilmFrame).particles.collisions;
    const auto& x = world.particles(system).position;
    for (std::size_t k = 1; k < x.size(); ++k)
      ASSERT_GT(x[k].x() - x[k - 1].x(), 0.99 * 2 * kRadius) << "step " << i;
  }
  EXPECT_GT(collisions, 500u);
}

TEST(ParticlePairs, FastSmallParticlesInACloudNeverOverlap) {
  World world({.gravity = Vec3::Zero()});
  const auto system = world.add_particle_system({.internal = true});
  const Scatter random{9};
  constexpr Real kRadius = 0.005;
  for (uint64_t i = 0; i < 1000; ++i) {
    // Particles from all sides move towards the middle.
    const auto at = [&](uint64_t k) { return random.uniform(i, k) - 0.5; };
    const Vec3 place(0.05 * static_cast<Real>(i % 10), 0.05 * static_cast<Real>(i / 10 % 10),
                     0.05 * static_cast<Real>(i / 100));
    world.add_particle(system,
                       {.position = place,
                        .velocity = 600 * (Vec3::Constant(0.225) - place) + 20 * Vec3(at(0), at(1), at(2)),
                        .mass = 0.001,
                        .radius = kRadius,
                        .restitution = 0.3});
  }
  for (int i = 0; i < 4; ++i) {
    world.step(kFilmFrame);
    const auto& x = world.particles(system).position;
    for (std::size_t k = 0; k < x.size(); ++k)
      for (std::size_t j = 0; j < k; ++j) ASSERT_GT((x[k] - x[j]).norm(), 0.98 * 2 * kRadius) << "step " << i;
  }
}

TEST(ParticlePairs, FlagsSayWhichSystemsCollide) {
  for (const bool internal : {false, true})
    for (const bool external : {false, true}) {
      World world({.gravity = Vec3::Zero()});
      const auto a = world.add_particle_system({.internal = internal, .external = true});
      const auto b = world.add_particle_system({.external = external});
      world.add_particle(a, {.position = {-0.05, 0, 0}, .velocity = {1, 0, 0}});
      world.add_particle(a, {.position = {0.05, 0, 0}, .velocity = {-1, 0, 0}});
      world.add_particle(a, {.position = {-0.05, 1, 0}, .velocity = {1, 0, 0}});
      world.add_particle(b, {.position = {0.05, 1, 0}, .velocity = {-1, 0, 0}});
      for (int i = 0; i < 10; ++i) world.step(kFilmFrame);
      EXPECT_EQ(world.particles(a).velocity[0].x() < 0, internal);
      EXPECT_EQ(world.particles(a).velocity[2].x() < 0, external);
    }
}

// Systems are empty at first, in between, and after all particles have died; the grid must not contain the
// earlier positions.
TEST(ParticlePairs, SystemsMayBeEmptyAtAnyTime) {
  World world({.gravity = Vec3::Zero(), .max_step = kFilmFrame});
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  const auto a = world.add_particle_system({.internal = true});
  world.add_particle_system({.external = true});
  EXPECT_EQ(world.step(kFilmFrame).particles.collisions, 0u);
  for (const std::size_t count : {300u, 0u, 2u, 0u, 5000u, 0u}) {
    for (std::size_t i = 0; i < count; ++i)
      world.add_particle(a, {.position = {0.1 * static_cast<Real>(i), 1, 0}, .lifespan = 1.5 * kFilmFrame});
    world.step(kFilmFrame);
    EXPECT_EQ(world.particles(a).size(), count);
    world.step(kFilmFrame);
    EXPECT_EQ(world.particles(a).size(), 0u);
  }
}

TEST(ParticlePairs, EventsListCollisionsAndDeathsInOrder) {
  World world({.gravity = Vec3::Zero(), .max_step = kFilmFrame});
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 1, .friction = 0});
  const auto pairs = world.add_particle_system({.internal = true, .report_collisions = true});
  const auto rain = world.add_particle_system({.report_collisions = true, .report_deaths = true});
  world.add_particle(pairs, {.position = {-0.015, 1, 0}, .velocity = {1, 0, 0}, .restitution = 1});
  world.add_particle(pairs, {.position = {0.015, 1, 0}, .velocity = {-1, 0, 0}, .restitution = 1});
  world.add_particle(rain,
                     {.position = {0, 0.02, 0}, .velocity = {0, -1, 0}, .lifespan = 0.015, .friction = 0});
  world.step(kFilmFrame);
  const auto events = world.particle_events();
  ASSERT_EQ(events.size(), 4u);
  EXPECT_EQ(events[0].id, 0u);
  EXPECT_EQ(events[1].id, 1u);
  for (std::size_t k : {0u, 1u}) {
    const Real side = k == 0 ? -1 : 1;
    EXPECT_EQ(events[k].system, pairs);
    EXPECT_NEAR(events[k].time, 0.005, 1e-12);
    EXPECT_NEAR((events[k].position - Vec3(side * 0.01, 1, 0)).norm(), 0, 1e-12);
    EXPECT_NEAR((events[k].velocity - Vec3(side, 0, 0)).norm(), 0, 1e-12);
    EXPECT_NEAR((events[k].normal - Vec3(side, 0, 0)).norm(), 0, 1e-12);
    EXPECT_NEAR(events[k].age, 0.005, 1e-12);
  }
  EXPECT_EQ(events[2].kind, ParticleEvent::Kind::collision);
  EXPECT_NEAR(events[2].time, 0.01, 1e-8);
  EXPECT_NEAR((events[2].velocity - Vec3(0, 1, 0)).norm(), 0, 1e-12);
  EXPECT_EQ(events[3].kind, ParticleEvent::Kind::death);
  EXPECT_NEAR(events[3].time, 0.015, 1e-12);
  world.step(kFilmFrame);
  EXPECT_TRUE(world.particle_events().empty());
}

TEST(ParticlePairs, StateIsTheSameForAnyNumberOfThreads) {
  std::vector<StateHash> hashes;
  for (std::size_t threads : {1u, 2u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    World world;
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
    world.add_body({.shape = Box{{0.3, 0.1, 0.3}}, .pose = {Vec3(0, 0.05, 0)}});
    const auto a = world.add_particle_system({.internal = true, .external = true});
    const auto b = world.add_particle_system({.external = true});
    const Scatter random{4};
    for (uint64_t i = 0; i < 2000; ++i)
      world.add_particle(i % 5 ? a : b,
                         {.position = {0.4 * random.uniform(i, 0) - 0.2, 0.15 + random.uniform(i, 1),
                                       0.4 * random.uniform(i, 2) - 0.2},
                          .mass = 0.001,
                          .radius = 0.01});
    for (int i = 0; i < 10; ++i) world.step(kFilmFrame);
    hashes.push_back(world.state_hash());
  }
  EXPECT_EQ(hashes[0].hex(), hashes[1].hex());
  EXPECT_EQ(hashes[0].hex(), hashes[2].hex());
}

}  // namespace
}  // namespace offstage::sim
