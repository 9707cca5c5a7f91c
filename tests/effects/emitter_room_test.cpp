// Emitters whose particles collide with particles: new ones keep their distance from living ones.
#include <algorithm>

#include <gtest/gtest.h>

#include "effects/emitter.h"

namespace offstage::effects {
namespace {

using namespace sim;

/// Smallest distance of the surfaces of two particles of two systems, or of one [m].
Real smallest_gap(const ParticleArrays& a, const ParticleArrays& b) {
  Real gap = 1e9;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < (&a == &b ? i : b.size()); ++j)
      gap = std::min(gap, (a.position[i] - b.position[j]).norm() - a.radius[i] - b.radius[j]);
  return gap;
}

struct Nozzle {
  const char* name;
  EmitterSurface surface;
  EmitterRelease release;
};

std::vector<Nozzle> nozzles() {
  const EmitterSurface plane{.size = {0.1, 0.1}}, disc{.kind = SurfaceKind::disc, .radius = 0.05},
      narrow{.size = {0.005, 0.005}};
  EmitterSurface mesh{.kind = SurfaceKind::mesh};
  mesh.mesh = {{{-0.05, 0, -0.05}, {-0.05, 0, 0.05}, {0.05, 0, 0.05}, {0.05, 0, -0.05}},
               {{0, 1, 2}, {0, 2, 3}}};
  return {{"rate of a plane", plane, {.rate = 5000.0}},
          {"rate of a disc", disc, {.rate = 5000.0}},
          {"rate of a mesh", mesh, {.rate = 5000.0}},
          {"rate of a nozzle as narrow as a particle", narrow, {.rate = 200.0}},
          {"count of a plane", plane, {.rate = 0.0, .count = 20.0, .interval = 0.004}},
          {"count of a disc", disc, {.rate = 0.0, .count = 20.0, .interval = 0.004}},
          {"burst of a mesh", mesh, {.rate = 0.0, .bursts = {{.count = 2000.0}}}},
          {"rate and count", plane, {.rate = 2000.0, .count = 10.0, .interval = 0.01}}};
}

// More particles than fit through the surface. All have the same velocity, so that the gaps after the flight
// are those at the birth.
TEST(EmitterRoom, ParticlesThatCollideWaitUntilOthersHaveLeft) {
  for (const Nozzle& nozzle : nozzles())
    for (const Real step : {1.0 / 240, 1.0 / 60, 1.0 / 10}) {
      SCOPED_TRACE(testing::Message() << nozzle.name << ", step " << step);
      World world({.gravity = Vec3::Zero(), .max_step = step});
      const auto system = world.add_particle_system({.linear_drag = 0, .internal = true});
      Emitter emitter({.surface = nozzle.surface,
                       .release = nozzle.release,
                       .particles = {.speed = 1.0, .radius = Uniform{0.008, 0.012}, .lifespan = 1e9}},
                      system);
      for (int i = 0; i < 5; ++i)
        world.step(0.1, [&](Real start, Real end) { emitter.emit(world, start, end); });
      EXPECT_GT(emitter.report().waiting, 10u);
      const ParticleArrays& p = world.particles(system);
      EXPECT_GT(smallest_gap(p, p), -1e-12);
      const bool is_narrow = nozzle.surface.size.x() < 0.01 && nozzle.surface.kind == SurfaceKind::plane;
      // A column of particles, or an eighth of the volume of the jet.
      EXPECT_GT(p.size(), is_narrow ? 20u : 150u);
    }
}

// The emitter moves to the side at the speed of the particles, which do not inherit it.
TEST(EmitterRoom, ParticlesOfAMovingEmitterDoNotOverlap) {
  World world({.gravity = Vec3::Zero()});
  const auto body = world.add_body(
      {.shape = Sphere{0.01},
       .motion = MotionType::kinematic,
       .collides = false,
       .track = {.keys = {{0, {}}, {10, {Vec3(10, 0, 0)}}}, .interpolation = Interpolation::linear}});
  const auto system = world.add_particle_system({.linear_drag = 0, .internal = true});
  Emitter emitter({.surface = {.size = {0.1, 0.1}},
                   .body = body,
                   .release = {.inherit_velocity = 0, .rate = 5000.0},
                   .particles = {.speed = 1.0, .radius = 0.01, .lifespan = 1e9}},
                  system);
  for (int i = 0; i < 5; ++i) world.step(0.1, [&](Real start, Real end) { emitter.emit(world, start, end); });
  const ParticleArrays& p = world.particles(system);
  EXPECT_GT(p.size(), 300u);
  EXPECT_GT(smallest_gap(p, p), -1e-12);
}

TEST(EmitterRoom, ExternalParticlesOfTwoEmittersAtOnePlaceDoNotOverlap) {
  World world({.gravity = Vec3::Zero()});
  const auto first = world.add_particle_system({.linear_drag = 0, .external = true}),
             second = world.add_particle_system({.linear_drag = 0, .external = true});
  const EmitterDef def{.surface = {.size = {0.1, 0.1}},
                       .release = {.rate = 300.0},
                       .particles = {.speed = 1.0, .radius = 0.01, .lifespan = 1e9}};
  Emitter a(def, first), b(def, second);
  for (int i = 0; i < 5; ++i)
    world.step(0.1, [&](Real start, Real end) {
      a.emit(world, start, end);
      b.emit(world, start, end);
    });
  EXPECT_GT(world.particles(first).size(), 100u);
  EXPECT_GT(world.particles(second).size(), 100u);
  // An emitter does not know when in the sub-step the other one has released a particle.
  EXPECT_GT(smallest_gap(world.particles(first), world.particles(second)), -1.0 / 240);
}

// Balls of 4 cm are poured through holes for one, four and nine of them. From the middles of cells they would
// stand exactly above each other: without friction four towers of 0.77 m, with friction one up to the hole.
TEST(EmitterRoom, PouredBallsBuildNoTowers) {
  for (const Real width : {0.05, 0.09, 0.13})
    for (const Real friction : {0.0, 0.2, 0.5}) {
      SCOPED_TRACE(testing::Message() << "hole of " << width << " m, friction " << friction);
      World world;
      world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
      // Balls that cannot roll stand on each other up to their friction angle.
      const auto system = world.add_particle_system({.internal = true, .rotates = friction > 0.3});
      Emitter emitter(
          {.surface = {.pose = {.position = {0, 1.5, 0}}, .size = {width, width}},
           .release = {.direction = -Vec3::UnitY(), .rate = 20.0, .end = 4},
           .particles =
               {.speed = 1.0, .radius = 0.02, .lifespan = 1e9, .restitution = 0.1, .friction = friction}},
          system);
      for (int i = 0; i < 50; ++i)
        world.step(0.1, [&](Real start, Real end) { emitter.emit(world, start, end); });
      const ParticleArrays& p = world.particles(system);
      EXPECT_EQ(p.size(), 80u);
      for (const Vec3& x : p.position) EXPECT_LT(x.y(), 0.1);
    }
}

}  // namespace
}  // namespace offstage::effects
