#include "sim/particles/particle_forces.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/world.h"

namespace offstage::sim {
namespace {

/// Returns the acceleration that one force gives a particle of 2 kg whose own drag coefficient is 0.5 kg/s.
Vec3 acceleration(const ForceDef& def, const Vec3& x, const Vec3& v = Vec3::Zero()) {
  const ParticleForces forces({.linear_drag = 0.5, .gravity = false}, Vec3::Zero(), Vec3::Zero(), {&def});
  const Real mass[] = {2};
  Vec3 dv;
  forces.accelerate(0, {x.data(), 3}, {v.data(), 3}, mass, {dv.data(), 3});
  return dv + 0.25 * v;  // subtracts the particle's own drag
}

TEST(ParticleForces, OfFieldsFallOffInTheirRegions) {
  const ForceDef sphere{.effect = ConstantField{{0, 8, 0}, SphereRegion{{1, 0, 0}, 2}, 1}};
  EXPECT_NEAR((acceleration(sphere, {1, 0, 0}) - Vec3(0, 4, 0)).norm(), 0, 1e-15);
  EXPECT_NEAR((acceleration(sphere, {1, 0.5, 0}) - Vec3(0, 3, 0)).norm(), 0, 1e-15);
  EXPECT_EQ(acceleration(sphere, {1, 0, 2.01}), Vec3::Zero());
  const ForceDef box{.effect = PointField{{0, 5, 0}, 6, BoxRegion{{0, 0, 0}, {2, 4, 4}}, 2}};
  EXPECT_NEAR((acceleration(box, {0, 1, 0}) - Vec3(0, 3 * 0.25, 0)).norm(), 0, 1e-15);
  EXPECT_EQ(acceleration(box, {1.01, 1, 0}), Vec3::Zero());
  EXPECT_EQ(acceleration(ForceDef{.effect = PointField{{0, 5, 0}, 6}}, {0, 5, 0}), Vec3::Zero());
}

TEST(ParticleForces, OfAirUseTheFieldsDragOrTheParticlesOwn) {
  const Vec3 wind(3, 0, 0), v(1, 2, 0);
  EXPECT_NEAR(
      (acceleration({.effect = WindField{.wind = wind, .drag = 4}}, Vec3::Zero(), v) - 2 * (wind - v)).norm(),
      0, 1e-15);
  // -k (v - wind) is the particle's own drag plus k wind.
  EXPECT_NEAR((acceleration({.effect = WindField{.wind = wind}}, Vec3::Zero(), v) - 0.25 * wind).norm(), 0,
              1e-15);
}

// The circulation: the integral of the velocity around a circle about the axis is Gamma r^2 / (r^2 + R^2).
TEST(Vortex, HasItsCirculationAndNoDivergence) {
  const Vortex vortex{.point = {1, 2, 3}, .axis = {1, 2, -2}, .circulation = 5, .radius = 0.4};
  const Vec3 axis = vortex.axis / 3, e1 = axis.unitOrthogonal(), e2 = axis.cross(e1);
  for (Real r : {0.1, 0.4, 3.0, 100.0}) {
    constexpr int kPieces = 64;
    Real sum = 0;
    for (int i = 0; i < kPieces; ++i) {
      const Real angle = 2 * std::numbers::pi * i / kPieces;
      const Vec3 out = std::cos(angle) * e1 + std::sin(angle) * e2;
      sum += velocity(vortex, vortex.point + r * out + 7 * i * axis).dot(axis.cross(out));
    }
    EXPECT_NEAR(sum * 2 * std::numbers::pi * r / kPieces, 5 * r * r / (r * r + 0.16), 1e-12);
  }
  EXPECT_NEAR(velocity(vortex, vortex.point + 0.4 * e1).norm(), 5 / (4 * std::numbers::pi * 0.4), 1e-12);
  EXPECT_EQ(velocity(vortex, vortex.point), Vec3::Zero());
  const Vec3 p = vortex.point + Vec3(0.2, 0.1, 0.3);
  Real divergence = 0;
  for (int k = 0; k < 3; ++k)
    divergence +=
        (velocity(vortex, p + 1e-5 * Vec3::Unit(k)) - velocity(vortex, p - 1e-5 * Vec3::Unit(k)))[k];
  EXPECT_NEAR(divergence, 0, 1e-12);
}

// Terminal velocity: m g = k (v - u).
TEST(ParticleForces, CarryParticlesToTheirTerminalSpeedInTheWind) {
  World world({.wind = {1, 0, 0}});
  const auto system = world.add_particle_system({.linear_drag = 0.2});
  world.add_force({.systems = {system}, .effect = WindField{.wind = {0, 0, 2}}});
  world.add_force({.systems = {system}, .effect = WindField{.wind = {0, 0, 2}, .drag = 0.2}});
  world.add_particle(system, {.mass = 0.04});
  for (int i = 0; i < 120; ++i) world.step(1.0 / 60);
  EXPECT_NEAR((world.particles(system).velocity[0] - Vec3(0.5, -0.04 * 9.81 / 0.4, 2)).norm(), 0, 1e-6);
}

TEST(ParticleForces, ActOnNamedObjectsOnly) {
  World world({.gravity = Vec3::Zero()});
  const auto a = world.add_particle_system({.name = "a"}), b = world.add_particle_system({.name = "b"});
  const BodyHandle body = world.add_body({.mass = 1});
  world.add_force({.systems = {a}, .effect = ConstantField{{1, 0, 0}}});
  world.add_force({.effect = ConstantField{{0, 1, 0}}});  // acts on all bodies
  world.add_force({.bodies = {body}, .systems = {b}, .effect = ConstantField{{0, 0, 1}}});
  for (auto system : {a, b}) world.add_particle(system, {.position = {9, 0, 0}});
  world.step(1);
  EXPECT_NEAR((world.particles(a).velocity[0] - Vec3(1, 0, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((world.particles(b).velocity[0] - Vec3(0, 0, 1)).norm(), 0, 1e-12);
  EXPECT_NEAR((world.body(body).velocity - Vec3(0, 1, 1)).norm(), 0, 1e-12);
}

TEST(ParticleForces, OfAGrabPullParticlesInItsReach) {
  World world;
  const auto system = world.add_particle_system({.linear_drag = 0.1, .integrator = IntegratorKind::rk4});
  world.add_force({.systems = {system},
                   .effect = Grab{.track = {.keys = {{.time = 0, .pose = {Vec3(0, 2, 0)}},
                                                     {.time = 1, .pose = {Vec3(1, 3, 0)}}}},
                                  .stiffness = 20,
                                  .damping = 2,
                                  .reach = 1.5}});
  world.add_particle(system, {.position = {0, 1, 0}, .mass = 0.5});
  world.add_particle(system, {.position = {5, 1, 0}, .mass = 0.5});
  for (int i = 0; i < 600; ++i) world.step(1.0 / 60);
  EXPECT_NEAR((world.particles(system).position[0] - Vec3(1, 3 - 0.5 * 9.81 / 20, 0)).norm(), 0, 1e-6);
  EXPECT_LT(world.particles(system).position[1].y(), -20);
}

TEST(ParticleForces, OfAnExplosionAreItsImpulse) {
  World world({.gravity = Vec3::Zero()});
  const auto system = world.add_particle_system({});
  world.add_force({.systems = {system}, .start = 0.5, .effect = Explosion{.impulse = 6, .radius = 4}});
  world.add_particle(system, {.position = {1, 0, 0}, .mass = 3});
  world.add_particle(system, {.position = {0, -5, 0}, .mass = 3});
  world.step(0.5);
  EXPECT_EQ(world.particles(system).velocity[0], Vec3::Zero());
  world.step(0.5);
  EXPECT_NEAR((world.particles(system).velocity[0] - Vec3(2 * 0.75, 0, 0)).norm(), 0, 1e-15);
  EXPECT_EQ(world.particles(system).velocity[1], Vec3::Zero());
}

// k/m = 1e6: explicit methods diverge at this step.
TEST(ParticleForces, StiffForcesAreStableWithImplicitEuler) {
  World world({.max_step = 1.0 / 30});
  const auto system =
      world.add_particle_system({.linear_drag = 100, .integrator = IntegratorKind::implicit_euler});
  world.add_force(
      {.systems = {system},
       .effect = Grab{.track = {.keys = {{.time = 0, .pose = {Vec3(0, 2, 0)}}}}, .stiffness = 1e5}});
  world.add_force({.systems = {system}, .effect = Turbulence{.speed = 1e-3, .drag = 50}});
  world.add_particle(system, {.position = {0, 1, 0}, .mass = 0.1});
  for (int i = 0; i < 30; ++i) {
    EXPECT_TRUE(world.step(1.0 / 30).finite);
    EXPECT_LT((world.particles(system).position[0] - Vec3(0, 2, 0)).norm(), 1.01);
  }
  EXPECT_NEAR((world.particles(system).position[0] - Vec3(0, 2, 0)).norm(), 0, 1e-4);
}

// The same particle in a system coupled by springs, in a system whose particles attract each other, and
// alone.
TEST(ParticleForces, AreTheSameForEveryKindOfSystem) {
  std::array<Vec3, 3> ends;
  for (std::size_t kind = 0; kind < ends.size(); ++kind) {
    World world;
    const auto system = world.add_particle_system({.linear_drag = 0.3, .integrator = IntegratorKind::rk4});
    world.add_particle(system, {.position = {1, 2, 3}, .velocity = {4, 3, 2}});
    const uint64_t other = world.add_particle(system, {.position = {500, 2, 3}});
    if (kind == 1) world.add_spring({.a = ParticlePoint{system, other}, .b = WorldPoint{{500, 3, 3}}});
    if (kind == 2)
      world.add_force({.systems = {system}, .effect = MutualGravitation{.constant = 1, .cut_off = 10}});
    world.add_force({.systems = {system}, .effect = Turbulence{.speed = 5, .scale = 0.7}});
    world.add_force(
        {.systems = {system},
         .effect =
             Vortex{.circulation = 9, .drag = 0.1, .region = SphereRegion{{2, 2, 2}, 4}, .drop_rate = 1}});
    world.add_force({.systems = {system}, .effect = PointField{.point = {0, 9, 0}, .force = 3}});
    for (int i = 0; i < 60; ++i) world.step(1.0 / 60);
    ends[kind] = world.particles(system).position[0];
  }
  EXPECT_NEAR((ends[1] - ends[0]).norm(), 0, 1e-12);
  EXPECT_NEAR((ends[2] - ends[0]).norm(), 0, 1e-12);
}

// A force field presses a particle onto a surface on which it slides, as gravity would.
TEST(ParticleForces, PressParticlesOntoSurfaces) {
  World world({.gravity = Vec3::Zero()});
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0, .friction = 0.25});
  const auto system = world.add_particle_system({});
  world.add_force({.systems = {system}, .effect = ConstantField{{0, -10, 0}}});
  world.add_particle(system,
                     {.position = {0, 0.01, 0}, .velocity = {3, 0, 0}, .restitution = 0, .friction = 0.25});
  for (int i = 0; i < 60; ++i) world.step(1.0 / 60);
  EXPECT_NEAR(world.particles(system).position[0].y(), 0.01, 1e-6);
  EXPECT_NEAR(world.particles(system).velocity[0].x(), 3 - 0.25 * 10, 0.05);
}

}  // namespace
}  // namespace offstage::sim
