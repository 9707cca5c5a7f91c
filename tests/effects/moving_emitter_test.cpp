// Emitters that move with a body: the fraction of its velocity that particles get, particles per metre, and
// recoil.

#include <gtest/gtest.h>

#include "effects/emitter.h"

namespace offstage::effects {
namespace {

using namespace sim;

struct Ride {
  World world{{.gravity = Vec3::Zero(), .sleep = false}};
  BodyHandle body;
  ParticleSystemHandle system = world.add_particle_system({.name = "s", .collides = false});

  explicit Ride(const Vec3& velocity) {
    BodyDef def;
    def.mass = 2;
    def.velocity = velocity;
    def.collides = false;
    body = world.add_body(def);
  }
  void run(EmitterDef def, Real seconds) {
    def.body = body;
    Emitter emitter(def, system);
    for (int i = 0; i < std::lround(seconds * 60); ++i)
      world.step(1.0 / 60, [&](Real start, Real end) { emitter.emit(world, start, end); });
  }
};

EmitterDef up(Real speed) {
  return {.name = "e",
          .surface = {.size = {0.1, 0.1}},
          .release = {.overlap = true, .rate = 60.0},
          .particles = {.speed = speed, .spread_deg = 0.0, .radius = 0.01, .mass = 0.001, .lifespan = 1e9}};
}

TEST(MovingEmitter, InheritsAFractionOfTheBodysVelocity) {
  for (const Real fraction : {0.0, 0.25, 1.0}) {
    Ride ride({4, 0, 0});
    EmitterDef def = up(3);
    def.release.inherit_velocity = fraction;
    ride.run(def, 0.5);
    const ParticleArrays& p = ride.world.particles(ride.system);
    ASSERT_GT(p.size(), 20u);
    for (const Vec3& v : p.velocity) EXPECT_LT((v - Vec3(4 * fraction, 3, 0)).norm(), 1e-12);
  }
}

// The number is the length of the path times the rate at any speed, and the places are evenly spaced.
TEST(MovingEmitter, ReleasesParticlesPerMetreOfItsPath) {
  for (const Real speed : {0.5, 7.0}) {
    Ride ride({speed, 0, 0});
    EmitterDef def = up(0);
    def.release.rate = 0.0;
    def.release.rate_per_metre = 20.0;
    def.release.inherit_velocity = 0;
    ride.run(def, 2);
    const ParticleArrays& p = ride.world.particles(ride.system);
    EXPECT_NEAR(static_cast<Real>(p.size()), 20 * 2 * speed, 1);
    // All particles are within the emitter's surface, which is 0.1 m wide.
    for (std::size_t i = 0; i < p.size(); ++i)
      EXPECT_NEAR(p.position[i].x(), (static_cast<Real>(i) + 1) / 20, 0.0501) << i;
  }
}

// Without the body's velocity, a particle takes m v and the body gets -m v: the total momentum stays 0.
TEST(MovingEmitter, RecoilPushesTheBodyBack) {
  Ride ride(Vec3::Zero());
  EmitterDef def = up(5);
  def.release.recoil = true;
  def.release.inherit_velocity = 0;
  def.release.rate = 600.0;
  ride.run(def, 1);
  const ParticleArrays& p = ride.world.particles(ride.system);
  EXPECT_GT(p.size(), 590u);
  Vec3 momentum = 2 * ride.world.body(ride.body).velocity;
  EXPECT_NEAR(momentum.y(), -0.001 * 5 * static_cast<Real>(p.size()), 1e-3);
  for (const Vec3& v : p.velocity) momentum += 0.001 * v;
  EXPECT_LT(momentum.norm(), 1e-12);
}

}  // namespace
}  // namespace offstage::effects
