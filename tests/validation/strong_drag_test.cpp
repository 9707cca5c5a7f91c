/// Drag, grabs and damped springs that are too strong for the explicit integrators: the motion follows closed
/// forms with every integrator, for bodies and for particles.

#include <array>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr std::array kAll = {IntegratorKind::explicit_euler,
                             IntegratorKind::symplectic_euler,
                             IntegratorKind::leapfrog,
                             IntegratorKind::midpoint,
                             IntegratorKind::rk4,
                             IntegratorKind::implicit_euler,
                             IntegratorKind::adaptive_midpoint,
                             IntegratorKind::dormand_prince};
constexpr Real kStep = 1.0 / 60;

/// A light ball and a particle of the same mass, far from each other.
struct Pair {
  World world;
  BodyHandle ball;
  ParticleSystemHandle system;

  Pair(IntegratorKind kind, Real mass, const Vec3& velocity, Real drag, const Vec3& gravity, Real turn = 0)
      : world({.gravity = gravity,
               .max_step = kStep,
               .integrator = kind,
               .sleep = false,
               .bounds = Aabb(Vec3::Constant(-1e4), Vec3::Constant(1e4))}) {
    ball = world.add_body({.shape = Sphere{0.05},
                           .pose = {Vec3(1, 0, 0)},
                           .velocity = velocity,
                           .mass = mass,
                           .linear_drag = drag,
                           .angular_drag = turn,
                           .collides = false});
    system = world.add_particle_system({.linear_drag = drag, .integrator = kind});
    world.add_particle(system, {.position = {1, 0, 0}, .velocity = velocity, .mass = mass});
  }
  void add(const ForceDef::Effect& effect) {
    world.add_force({.bodies = {ball}, .systems = {system}, .effect = effect});
  }
  void run(Real time) {
    for (int i = 0; i < std::lround(time / kStep); ++i) world.step(kStep);
  }
  std::array<Vec3, 2> positions() const {
    return {world.body(ball).pose.position, world.particles(system).position[0]};
  }
  std::array<Vec3, 2> velocities() const {
    return {world.body(ball).velocity, world.particles(system).velocity[0]};
  }
};

// x + tau v - v_t t is constant, with tau = m / c and the terminal velocity v_t = g tau. The drags of the
// object and of all fields add up. Each of them alone would be stable in the second case.
TEST(StrongDrag, SumsOfDragsLeadToTheTerminalVelocity) {
  for (const IntegratorKind kind : kAll)
    for (const Real rate : {20.0, 4 / kStep, 1e7}) {
      const Real mass = 0.002, quarter = mass * rate / 4;
      Pair pair(kind, mass, {3, 4, 0}, quarter, {0, -9.81, 0});
      pair.add(WindField{.drag = quarter});
      pair.add(Vortex{.circulation = 0, .drag = quarter});
      pair.add(Turbulence{.speed = 0, .drag = quarter});
      pair.run(1);
      const Vec3 terminal(0, -9.81 / rate, 0);
      for (const Vec3& v : pair.velocities())
        EXPECT_LT((v - terminal).norm(), 1e-2 * terminal.norm()) << static_cast<int>(kind) << ' ' << rate;
      const Vec3 expected = Vec3(1, 0, 0) + terminal + (Vec3(3, 4, 0) - terminal) / rate;
      for (const Vec3& x : pair.positions())
        EXPECT_LT((x - expected).norm(),
                  0.06 * (expected - Vec3(1, 0, 0)).norm() + (kStep * rate < 1 ? kStep * 5 : 0))
            << static_cast<int>(kind) << ' ' << rate;
    }
}

// A ball of 2 g in a vortex with a drag of 1 kg/s moves with the air: its slip is the centrifugal one,
// dr/dt = tau w^2 r, with w = Gamma / (2 pi (r^2 + R^2)).
TEST(StrongDrag, InAVortexALightBodyMovesWithTheAir) {
  for (const IntegratorKind kind : kAll) {
    const bool is_first_order = kind == IntegratorKind::implicit_euler;
    Pair pair(kind, 0.002, {0, 0, -1}, 0, Vec3::Zero(), 1e-3);
    pair.add(Vortex{.circulation = 2 * std::numbers::pi * 1.01, .radius = 0.1, .drag = 1});
    pair.run(3);
    for (const Vec3& x : pair.positions()) {
      EXPECT_NEAR(x.norm(), 1 + 0.002 * 3, is_first_order ? 0.06 : 1.5e-3) << static_cast<int>(kind);
      EXPECT_NEAR(std::atan2(-x.z(), x.x()), 3, is_first_order ? 0.1 : 0.03) << static_cast<int>(kind);
    }
  }
}

TEST(StrongDrag, SpinsEndAndWindTakesLightBodiesAlong) {
  for (const IntegratorKind kind : kAll) {
    World world({.gravity = Vec3::Zero(), .wind = {2, 0, 0}, .max_step = kStep, .integrator = kind});
    const BodyHandle plate = world.add_body({.shape = Box{Vec3(0.2, 0.02, 0.1)},
                                             .angular_velocity = {3, 2, 1},
                                             .mass = 0.005,
                                             .linear_drag = 2,
                                             .angular_drag = 0.01});
    for (int i = 0; i < 60; ++i) world.step(kStep);
    EXPECT_LT((world.body(plate).velocity - Vec3(2, 0, 0)).norm(), 1e-5) << static_cast<int>(kind);
    EXPECT_LT(world.body(plate).angular_velocity.norm(), 1e-4) << static_cast<int>(kind);
    EXPECT_NEAR(world.body(plate).pose.position.x(), 2 - 2 * 0.005 / 2, 1e-3) << static_cast<int>(kind);
  }
}

// The default grab, 100 N/m and 10 N s/m, at objects of 1 g that also have drag.
TEST(StrongDrag, AGrabHoldsLightObjects) {
  for (const IntegratorKind kind : kAll) {
    Pair pair(kind, 0.001, {0, 3, 0}, 0.1, {0, -9.81, 0});
    Grab grab{.point = {0.05, 0, 0}};
    grab.track.keys = {{.time = 0, .pose = {Vec3(1, 1, 0)}}};
    pair.world.add_force({.bodies = {pair.ball}, .effect = grab});
    pair.world.add_force({.systems = {pair.system}, .effect = grab});
    pair.run(3);
    const auto body = pair.world.body(pair.ball);
    EXPECT_LT((body.pose.point_to_world(grab.point) - Vec3(1, 1, 0)).norm(), 2e-3) << static_cast<int>(kind);
    EXPECT_LT((pair.positions()[1] - Vec3(1, 1, 0)).norm(), 2e-3) << static_cast<int>(kind);
  }
}

// Two light balls and a particle in a triangle of springs whose dampers are strong, with drag and angular
// drag. Springs and dampers are internal forces, so the momentum follows the drag alone.
TEST(StrongDrag, DampedSpringsActTogetherWithDrag) {
  for (const IntegratorKind kind : kAll) {
    World world({.gravity = Vec3::Zero(), .max_step = kStep, .integrator = kind});
    std::vector<BodyHandle> balls;
    for (const Real x : {-0.5, 0.5})
      balls.push_back(world.add_body({.shape = Sphere{0.05},
                                      .pose = {Vec3(x, 0, 0)},
                                      .velocity = {0, 1, 0},
                                      .mass = 0.002,
                                      .linear_drag = 0.002,
                                      .angular_drag = 1e-4}));
    const ParticleSystemHandle system = world.add_particle_system({.linear_drag = 0.002, .gravity = false});
    world.add_particle(system, {.position = {0, 0.8, 0}, .velocity = {0, 1, 0}, .mass = 0.002});
    const ParticlePoint top{system, world.particles(system).id[0]};
    const auto tie = [&](const Attachment& a, const Attachment& b) {
      world.add_spring({.a = a, .b = b, .stiffness = 0.5, .damping = 0.3, .rest_length = 0.8});
    };
    tie(BodyPoint{balls[0], Vec3(0.05, 0, 0)}, BodyPoint{balls[1], Vec3(-0.05, 0, 0)});
    tie(BodyPoint{balls[0], Vec3(0, 0.05, 0)}, top);
    tie(BodyPoint{balls[1], Vec3(0, 0.05, 0)}, top);
    for (int i = 0; i < 600; ++i) world.step(kStep);
    // The momentum decays with tau = 1 s, over a distance of 1 m.
    Vec3 centre = world.particles(system).position[0];
    for (const BodyHandle ball : balls) centre += world.body(ball).pose.position;
    EXPECT_LT((centre / 3 - Vec3(0, 0.8 / 3 + 1, 0)).norm(), 0.02) << static_cast<int>(kind);
    EXPECT_LT(world.body(balls[0]).velocity.norm(), 1e-3) << static_cast<int>(kind);
    const Vec3 gap = world.body(balls[0]).pose.point_to_world(Vec3(0.05, 0, 0)) -
                     world.body(balls[1]).pose.point_to_world(Vec3(-0.05, 0, 0));
    EXPECT_NEAR(gap.norm(), 0.8, 1e-3) << static_cast<int>(kind);
  }
}

// A pendulum in honey: c L^2 theta' = -m g L sin theta, so tan(theta / 2) decays with the rate m g / (c L).
TEST(StrongDrag, APendulumCreepsDown) {
  for (const IntegratorKind kind : {IntegratorKind::leapfrog, IntegratorKind::rk4})
    for (const Real rate : {600.0, 6e4}) {
      World world({.max_step = kStep, .integrator = kind, .sleep = false});
      const BodyHandle bob = world.add_body(
          {.shape = Sphere{0.01}, .pose = {Vec3(1, 0, 0)}, .mass = 0.1, .linear_drag = 0.1 * rate});
      world.add_joint({.a = bob, .anchor = Vec3::Zero()});
      for (int i = 0; i < 30; ++i) world.step(kStep);
      const Vec3 x = world.body(bob).pose.position;
      EXPECT_NEAR(x.norm(), 1, 1e-6);
      const Real angle = std::atan2(x.x(), -x.y());
      EXPECT_NEAR(std::numbers::pi / 2 - angle, 0.5 * 9.81 / rate, 0.03 * 0.5 * 9.81 / rate) << rate;
    }
}

}  // namespace
}  // namespace offstage::sim
