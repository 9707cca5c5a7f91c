/// Particles with forces between each other, compared with closed forms.

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>
#include <oneapi/tbb/task_arena.h>

#include "sim/world.h"

namespace offstage::sim {
namespace {

struct Pair {
  World world{{.gravity = Vec3::Zero()}};
  ParticleSystemHandle system;

  Pair(const Particle& a, const Particle& b, const decltype(ForceDef::effect)& law) {
    system = world.add_particle_system({.integrator = IntegratorKind::rk4});
    world.add_particle(system, a);
    world.add_particle(system, b);
    world.add_force({.systems = {system}, .effect = law});
  }
  Vec3 gap() const { return world.particles(system).position[0] - world.particles(system).position[1]; }
  Vec3 speed() const { return world.particles(system).velocity[0] - world.particles(system).velocity[1]; }
};

// The relative motion is an ellipse with semi-major axis a, eccentricity e and period 2 pi sqrt(a^3 / (G (m1
// + m2))). At the smallest distance a (1 - e) the speed is sqrt(G M (1 + e) / (a (1 - e))).
TEST(Kepler, OrbitOfTwoParticlesClosesAfterTenPeriods) {
  constexpr Real kM1 = 2, kM2 = 1, kA = 1, kE = 0.5, kPeriods = 10;
  const Real period = 4, G = std::pow(2 * std::numbers::pi / period, 2) * kA * kA * kA / (kM1 + kM2);
  const Real v = std::sqrt(G * (kM1 + kM2) * (1 + kE) / (kA * (1 - kE)));
  Pair pair({.position = {kA * (1 - kE) * kM2 / 3, 0, 0}, .velocity = {0, 0, v * kM2 / 3}, .mass = kM1},
            {.position = {-kA * (1 - kE) * kM1 / 3, 0, 0}, .velocity = {0, 0, -v * kM1 / 3}, .mass = kM2},
            MutualGravitation{.constant = G});
  const Vec3 gap = pair.gap(), speed = pair.speed();
  const Real energy = pair.world.energy().total();
  Real farthest = 0;
  for (int i = 0; i < static_cast<int>(kPeriods * period * 240); ++i) {
    pair.world.step(1.0 / 240);
    farthest = std::max(farthest, pair.gap().norm());
  }
  EXPECT_NEAR((pair.gap() - gap).norm(), 0, 1e-4);
  EXPECT_NEAR((pair.speed() - speed).norm() / speed.norm(), 0, 1e-4);
  EXPECT_NEAR(farthest, kA * (1 + kE), 1e-4);
  EXPECT_NEAR(pair.world.energy().total() / energy, 1, 1e-4);
  const auto& p = pair.world.particles(pair.system);
  EXPECT_NEAR((kM1 * p.velocity[0] + kM2 * p.velocity[1]).norm(), 0, 1e-13);
}

// Energy: mu v^2 / 2 = K q1 q2 (1/r0 - 1/r), with mu = m1 m2 / (m1 + m2).
TEST(Charges, ReleasedAtRestFlyApartWithTheirEnergy) {
  const Real k = 8.9875e9, q1 = 1e-5, q2 = 3e-5, mu = 0.5 * 1.5 / 2;
  Pair pair({.position = {0, 0, 0}, .mass = 0.5, .charge = q1},
            {.position = {0, 1, 0}, .mass = 1.5, .charge = q2}, Coulomb{});
  for (int i = 0; i < 240; ++i) pair.world.step(1.0 / 60);
  const Real r = pair.gap().norm(), v = std::sqrt(2 / mu * k * q1 * q2 * (1 - 1 / r));
  EXPECT_GT(r, 8);
  EXPECT_NEAR(pair.speed().norm() / v, 1, 1e-4);
}

TEST(Charges, FiredAtEachOtherTurnAroundAtTheDistanceOfTheirEnergy) {
  const Real k = 8.9875e9, q = 1e-5, mu = 0.5, v = 4;
  const Real nearest = 1 / (1 / 2.0 + mu * v * v / (2 * k * q * q));
  Pair pair({.position = {1, 0, 0}, .velocity = {-v / 2, 0, 0}, .charge = q},
            {.position = {-1, 0, 0}, .velocity = {v / 2, 0, 0}, .charge = q}, Coulomb{});
  Real least = 2;
  for (int i = 0; i < 240; ++i) {
    pair.world.step(1.0 / 240);
    least = std::min(least, pair.gap().norm());
  }
  EXPECT_NEAR(least, nearest, 1e-4);
  EXPECT_GT(pair.gap().norm(), 1);
}

// With q = (sigma / r)^6, the potential equals the energy -0.5 epsilon where q^2 - q = -1/8.
TEST(LennardJones, PairOscillatesBetweenItsTurningPoints) {
  constexpr Real kSigma = 0.1;
  const Real root = std::sqrt(0.5), far = kSigma * std::pow((1 - root) / 2, -1 / 6.0),
             near = kSigma * std::pow((1 + root) / 2, -1 / 6.0);
  Pair pair({.position = {far, 0, 0}}, {}, LennardJones{.epsilon = 0.02, .sigma = kSigma});
  Real least = far, greatest = 0;
  for (int i = 0; i < 2400; ++i) {
    pair.world.step(1.0 / 240);
    least = std::min(least, pair.gap().norm());
    if (i > 1200) greatest = std::max(greatest, pair.gap().norm());
  }
  EXPECT_NEAR(least / near, 1, 1e-4);
  EXPECT_NEAR(greatest / far, 1, 1e-4);
}

/// Returns a lattice of molecules with thermal velocities, in two particle systems.
World gas(std::array<ParticleSystemHandle, 2>& systems) {
  World world({.gravity = Vec3::Zero()});
  std::mt19937 random(1);
  std::uniform_real_distribution<Real> any(-0.5, 0.5);
  for (auto& system : systems) system = world.add_particle_system({.collides = false});
  for (int i = 0; i < 1000; ++i)
    world.add_particle(systems[i % 2], {.position = 0.12 * Vec3(i % 10, i / 10 % 10, i / 100),
                                        .velocity = {any(random), any(random), any(random)},
                                        .mass = i % 2 ? 1.0 : 2.0});
  world.add_force({.systems = {systems[0], systems[1]},
                   .effect = LennardJones{.epsilon = 0.02, .sigma = 0.1, .cut_off = 0.25}});
  return world;
}

TEST(LennardJones, GasKeepsItsEnergyAndMomentumAcrossSystems) {
  std::array<ParticleSystemHandle, 2> systems;
  World world = gas(systems);
  const auto momentum = [&] {
    Vec3 sum = Vec3::Zero();
    for (auto system : systems) {
      const ParticleArrays& p = world.particles(system);
      for (std::size_t i = 0; i < p.size(); ++i) sum += p.mass[i] * p.velocity[i];
    }
    return sum;
  };
  const Vec3 before = momentum();
  const Real kinetic = world.energy().kinetic, total = world.energy().total();
  Real change = 0;
  for (int i = 0; i < 120; ++i) {
    world.step(1.0 / 120);
    change = std::max(change, std::abs(world.energy().kinetic - kinetic));
  }
  EXPECT_NEAR((momentum() - before).norm(), 0, 1e-11);
  EXPECT_GT(change, 1);
  EXPECT_NEAR(world.energy().total(), total, 0.01 * change);
}

TEST(ParticleForces, GiveTheSameStateForAnyThreads) {
  const auto run = [](int threads) {
    StateHash hash;
    tbb::task_arena(threads).execute([&] {
      std::array<ParticleSystemHandle, 2> systems;
      World world = gas(systems);
      world.add_force({.systems = {systems[0]}, .effect = Turbulence{.drag = 0.1}});
      world.add_force({.systems = {systems[1]}, .effect = Coulomb{.constant = 1}});
      for (int i = 0; i < 10; ++i) world.step(1.0 / 60);
      hash = world.state_hash();
    });
    return hash;
  };
  const StateHash one = run(1);
  EXPECT_EQ(one, run(2));
  EXPECT_EQ(one, run(2));
}

}  // namespace
}  // namespace offstage::sim
