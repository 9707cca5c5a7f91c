/// Particles that hit bodies, in particular bodies with joints and bodies hit by many particles at once
/// (physics P8, A3), compared with closed forms and invariants.

#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "sim/core/rotation.h"
#include "sim/world.h"
#include "tests/random.h"

namespace offstage::sim {
namespace {

const Vec3 kSize(1, 0.2, 1);
constexpr Real kHitMass = 2, kHitArm = 0.45, kHitSpeed = 3;

BodyHandle add_plate(World& world, const Vec3& position = Vec3::Zero()) {
  return world.add_body(
      {.shape = Box{kSize}, .pose = {position}, .mass = kHitMass, .restitution = 1, .friction = 0});
}

World weightless(Real max_step = 1.0 / 240) {
  return World({.gravity = Vec3::Zero(), .max_step = max_step, .sleep = false});
}

/// Lets a particle fall on the end of a plate and bounce; returns its velocity afterwards.
Real rebound(World& world, bool internal) {
  const auto system = world.add_particle_system({.internal = internal});
  world.add_particle(system, {.position = {kHitArm, 0.5, 0},
                              .velocity = {0, -kHitSpeed, 0},
                              .mass = 0.5,
                              .radius = 0.02,
                              .restitution = 1,
                              .friction = 0});
  const Real before = world.energy().kinetic;
  for (int i = 0; i < 30; ++i) world.step(1.0 / 60);
  EXPECT_NEAR(world.energy().kinetic, before, 1e-9 * before);
  return world.particles(system).velocity[0].y();
}

/// Returns the velocity after an elastic impact on a body of this effective mass.
Real rebound_from(Real mass) {
  return kHitSpeed * (mass - 0.5) / (mass + 0.5);
}

TEST(ParticlesAndJoints, AParticleMeetsTheInertiaOfAHingedPlateAndTheMassOfARailedOne) {
  for (const bool internal : {false, true}) {
    World hinged = weightless();
    hinged.add_joint({.type = JointType::revolute, .a = add_plate(hinged), .anchor = {-0.5, 0, 0}});
    const Real inertia = kHitMass * ((1 + 0.04) / 12 + 0.25), reach = kHitArm + 0.5;
    EXPECT_NEAR(rebound(hinged, internal), rebound_from(inertia / (reach * reach)), 1e-9);

    World railed = weightless();
    railed.add_joint({.type = JointType::prismatic, .a = add_plate(railed), .axis = Vec3::UnitY()});
    EXPECT_NEAR(rebound(railed, internal), rebound_from(kHitMass), 1e-9);

    World fixed = weightless();
    fixed.add_joint({.type = JointType::fixed, .a = add_plate(fixed)});
    EXPECT_NEAR(rebound(fixed, internal), kHitSpeed, 1e-9);
  }
}

// The hinge can turn in one direction only: against the other direction the plate acts like a wall.
TEST(ParticlesAndJoints, AJointAtItsLimitMovesInOneDirectionOnly) {
  const Real inertia = kHitMass * ((1 + 0.04) / 12 + 0.25), reach = kHitArm + 0.5;
  for (const bool internal : {false, true})
    for (const bool opens : {false, true}) {
      World world = weightless();
      JointDef hinge{.type = JointType::revolute, .a = add_plate(world), .anchor = {-0.5, 0, 0}};
      (opens ? hinge.upper : hinge.lower) = 0;  // an impact from above turns the plate clockwise
      world.add_joint(hinge);
      EXPECT_NEAR(rebound(world, internal), opens ? rebound_from(inertia / (reach * reach)) : kHitSpeed,
                  1e-9);

      World railed = weightless();
      JointDef rail{.type = JointType::prismatic, .a = add_plate(railed), .axis = Vec3::UnitY()};
      (opens ? rail.upper : rail.lower) = 0;
      railed.add_joint(rail);
      EXPECT_NEAR(rebound(railed, internal), opens ? rebound_from(kHitMass) : kHitSpeed, 1e-9);
    }
}

// The far end of the plate is connected to a second plate by a hinge, so the impact also moves that plate.
TEST(ParticlesAndJoints, AnImpulseReachesEveryLinkAndTheJointsHold) {
  World world = weightless();
  const BodyHandle first = add_plate(world), second = add_plate(world, {-1, 0, 0}),
                   third = add_plate(world, {-2, 0, 0});
  const JointHandle near =
      world.add_joint({.type = JointType::revolute, .a = first, .b = second, .anchor = {-0.5, 0, 0}});
  world.add_joint({.type = JointType::revolute, .a = second, .b = third, .anchor = {-1.5, 0, 0}});
  const auto system = world.add_particle_system({});
  world.add_particle(system, {.position = {0, 0.2, 0},
                              .velocity = {0, -kHitSpeed, 0},
                              .mass = 0.5,
                              .radius = 0.02,
                              .restitution = 1,
                              .friction = 0});
  const Real before = world.energy().kinetic;
  for (int i = 0; i < 12; ++i) world.step(1.0 / 240);
  EXPECT_GT(world.particles(system).velocity[0].y(), 0);
  EXPECT_NEAR(world.energy().kinetic, before, 1e-6 * before);
  Vec3 momentum = 0.5 * world.particles(system).velocity[0];
  for (const BodyHandle b : {first, second, third}) {
    momentum += kHitMass * world.body(b).velocity;
    EXPECT_GT(world.body(b).angular_velocity.norm(), 0.05);
  }
  EXPECT_NEAR((momentum - Vec3(0, -0.5 * kHitSpeed, 0)).norm(), 0, 1e-9);
  EXPECT_LT(world.joint(near).error, 1e-9);
}

/// A floor of static boxes of this side [m] along X, whose tops are at the height 0. The boxes from the n-th
/// on are higher by `step` [m].
void add_tiles(World& world, Real side, int n, Real step) {
  for (int i = 0; i < 2 * n; ++i)
    world.add_body({.shape = Box{{side, 0.1, 1}},
                    .motion = MotionType::static_body,
                    .pose = {Vec3((i - n + 0.5) * side, (i < n ? 0 : step) - 0.05, 0)},
                    .restitution = 0,
                    .friction = 0});
}

// Particles that have resting contacts slide over the seams between flush boxes as on one box. They start in
// exact contact, which is nearer than the distance of 1e-10 m that they keep later: at the first seam they
// touch the edge with a normal that is tilted by sqrt(1e-10 m / radius), which takes 1e-6 of their speed.
TEST(ParticlesAndBodies, SeamsBetweenFlushBoxesDoNotStopParticles) {
  struct Variant {
    bool internal, external, rotates;
  };
  for (const Variant v :
       {Variant{true, false, false}, Variant{false, true, false}, Variant{false, false, true}}) {
    for (const Real radius : {0.01, 0.05}) {
      for (const Real side : {0.05, 0.25, 2.0}) {
        for (const Real h : {1.0 / 60, 1.0 / 240}) {
          World world({.max_step = h, .sleep = false});
          add_tiles(world, side, static_cast<int>(std::ceil(2 / side)), 0);
          const auto system = world.add_particle_system(
              {.internal = v.internal, .external = v.external, .rotates = v.rotates});
          world.add_particle(system, {.position = {-1.5, radius, 0.03},
                                      .velocity = {5, 0, 0},
                                      .mass = 1,
                                      .radius = radius,
                                      .restitution = 0,
                                      .friction = 0});
          Real highest = 0;
          for (int i = 0; i < 36; ++i) {
            world.step(1.0 / 60);
            highest = std::max(highest, world.particles(system).position[0].y());
          }
          EXPECT_NEAR(world.particles(system).position[0].x(), 1.5, 5e-6)
              << radius << ' ' << side << ' ' << h;
          EXPECT_LT(highest, radius + 5e-6) << radius << ' ' << side << ' ' << h;
        }
      }
    }
  }
}

// A ball whose friction has brought it to rolling has 2/7 of the conveyor's speed.
TEST(ParticlesAndBodies, AConveyorCarriesParticles) {
  constexpr Real kBelt = 1, kMu = 0.5, kRadius = 0.05;
  for (const Real step : {1.0 / 240, 1.0 / 60})
    for (const bool internal : {false, true})
      for (const bool rotates : {false, true}) {
        World w({.max_step = step});
        w.add_body({.shape = Box{{10, 1, 2}},
                    .motion = MotionType::static_body,
                    .pose = {Vec3(0, -0.5, 0)},
                    .restitution = 0,
                    .friction = kMu,
                    .surface_velocity = {kBelt, 0.5, 0}});
        const auto system = w.add_particle_system({.internal = internal, .rotates = rotates});
        w.add_particle(
            system,
            {.position = {0, kRadius, 0}, .mass = 0.1, .radius = kRadius, .restitution = 0, .friction = kMu});
        for (Real t = 0; t < 2 - step / 2; t += step) w.step(step);
        const Real speed = rotates ? 2.0 / 7 * kBelt : kBelt, takes = speed / (kMu * 9.81);
        EXPECT_NEAR(w.particles(system).velocity[0].x(), speed, 1e-5);
        EXPECT_NEAR(w.particles(system).position[0].x(), speed * (2 - takes / 2), speed * step / 2);
        EXPECT_NEAR(w.particles(system).position[0].y(), kRadius, 1e-6);
      }
}

/// Keys of a tray that moves by 2 m to the right and up, and tilts by `tilt` [rad] within `duration`.
KeyframeTrack tilting(Real tilt, Real duration) {
  KeyframeTrack track;
  track.keys = {{0, {Vec3::Zero(), Quat::Identity()}},
                {duration, {Vec3(2, 2, 0), Quat(Eigen::AngleAxisd(tilt, Vec3::UnitZ()))}}};
  return track;
}

// The floor moves on an arc, so in its frame the straight paths of resting particles end below it. Particles
// without friction must stay on it as well. Particles that push each other against a wall may enter the floor
// by a tenth of their radius.
TEST(ParticlesAndBodies, ATrayThatMovesAndTurnsKeepsItsGrains) {
  constexpr Real kRadius = 0.03;
  for (const Real step : {1.0 / 240, 1.0 / 60})
    for (const bool internal : {false, true})
      for (const auto& [degrees, duration] : {std::pair{20, 1.0}, {20, 0.25}, {60, 0.5}})
        for (const Real friction : {0.0, 0.5}) {
          World w({.max_step = step});
          const MeshHandle mesh = w.add_compound({solid_mesh(OpenBox{{0.6, 0.3, 0.6}, 0.03})});
          const auto tray = w.add_body({.shape = MeshShape{mesh},
                                        .motion = MotionType::kinematic,
                                        .restitution = 0,
                                        .friction = friction,
                                        .track = tilting(degrees * std::numbers::pi / 180, duration)});
          const auto system = w.add_particle_system({.internal = internal});
          for (const Real x : {-0.2, -0.05, 0.1})
            w.add_particle(system, {.position = {x, -0.09, 0},
                                    .mass = 0.1,
                                    .radius = kRadius,
                                    .restitution = 0.1,
                                    .friction = friction});
          for (Real t = 0; t < 1.2 * duration; t += 1.0 / 60) {
            const StepReport r = w.step(1.0 / 60);
            EXPECT_EQ(r.particles.truncated, 0);
            const Pose pose = w.body(tray).pose;
            for (const Vec3& p : w.particles(system).position)
              EXPECT_GT(pose.point_to_body(p).y(), -0.12 + kRadius - (internal ? 0.1 * kRadius : 1e-9));
          }
        }
}

// A step of a fifth of the radius is no seam: without restitution, the particle loses the part of its
// velocity that points into the edge.
TEST(ParticlesAndBodies, ALowStepHoldsParticlesBack) {
  World world({.max_step = 1.0 / 240, .sleep = false});
  add_tiles(world, 1, 2, 0.01);
  const auto system = world.add_particle_system({.internal = true});
  world.add_particle(system, {.position = {-1, 0.05, 0},
                              .velocity = {2, 0, 0},
                              .mass = 1,
                              .radius = 0.05,
                              .restitution = 0,
                              .friction = 0});
  for (int i = 0; i < 33; ++i) world.step(1.0 / 60);
  EXPECT_GT(world.particles(system).position[0].y(), 0.06);
  EXPECT_LT(world.particles(system).velocity[0].x(), 1.5);
}

// A hundred particles that are heavier than the plate together: resolving each impact on its own would add
// energy.
TEST(ParticlesAndBodies, ManyHitsOnALightBodyInOneStepKeepMomentumAndEnergy) {
  for (const bool internal : {false, true})
    for (const bool railed : {false, true}) {
      World world = weightless(1.0 / 60);
      const BodyHandle plate = add_plate(world);
      if (railed) world.add_joint({.type = JointType::prismatic, .a = plate, .axis = Vec3::UnitY()});
      const auto jet = world.add_particle_system({.internal = internal});
      for (int i = 0; i < 10; ++i)
        for (int k = 0; k < 10; ++k)
          world.add_particle(jet,
                             {.position = {0.08 * i - 0.4, 0.15 + 0.0003 * (i + 10 * k), 0.08 * k - 0.36},
                              .velocity = {0, -kHitSpeed, 0},
                              .mass = 0.05,
                              .radius = 0.01,
                              .restitution = 1,
                              .friction = 0});
      const Real energy = world.energy().kinetic;
      for (int i = 0; i < 6; ++i) world.step(1.0 / 60);
      Real momentum = kHitMass * world.body(plate).velocity.y();
      for (const Vec3& v : world.particles(jet).velocity) momentum += 0.05 * v.y();
      EXPECT_NEAR(world.energy().kinetic, energy, 1e-9 * energy) << internal << railed;
      EXPECT_NEAR(momentum, -5 * kHitSpeed, 1e-9) << internal << railed;
    }
}

/// Simulates an elastic gas in a shaft, below a lid with weight. Returns the greatest relative change of
/// energy.
Real gas_drift(bool joined, bool internal, Real max_step, Real seconds, uint64_t seed = 5) {
  World world({.max_step = max_step, .sleep = false});
  const auto wall = [&](const Vec3& at, const Vec3& normal) {
    world.add_body({.shape = Plane{},
                    .motion = MotionType::static_body,
                    .pose = {at, rotation_between(Vec3::UnitY(), normal)},
                    .restitution = 1,
                    .friction = 0});
  };
  wall(Vec3::Zero(), Vec3::UnitY());
  for (const Real side : {-1.0, 1.0}) {
    wall({0.5 * side, 0, 0}, {-side, 0, 0});
    wall({0, 0, 0.5 * side}, {0, 0, -side});
  }
  const BodyHandle lid = world.add_body(
      {.shape = Box{{0.98, 0.1, 0.98}}, .pose = {Vec3(0, 1, 0)}, .mass = 2, .restitution = 1, .friction = 0});
  if (joined)
    world.add_joint({.type = JointType::prismatic, .a = lid, .anchor = {0, 1, 0}, .axis = Vec3::UnitY()});
  const auto gas = world.add_particle_system({.internal = internal});
  const Scatter random{seed};
  for (uint64_t i = 0; i < 20; ++i)
    world.add_particle(gas, {.position = {random.uniform(i, 0) * 0.9 - 0.45, 0.1 + 0.8 * random.uniform(i, 1),
                                          random.uniform(i, 2) * 0.9 - 0.45},
                             .velocity = 8 * Vec3(random.uniform(i, 3) - 0.5, random.uniform(i, 4) - 0.5,
                                                  random.uniform(i, 5) - 0.5),
                             .mass = 0.2,
                             .radius = 0.02,
                             .restitution = 1,
                             .friction = 0});
  const Real before = world.energy().total();
  Real greatest = 0;
  for (int i = 0; i < seconds * 60; ++i) {
    world.step(1.0 / 60);
    greatest = std::max(greatest, std::abs(world.energy().total() / before - 1));
  }
  EXPECT_EQ(world.particle_count(), 20u);
  return greatest;
}

TEST(ParticlesAndJoints, AGasUnderARailedLidKeepsItsEnergy) {
  EXPECT_LT(gas_drift(true, false, 1.0 / 240, 10), 1e-3);
  EXPECT_LT(gas_drift(true, true, 1.0 / 240, 10), 1e-3);
}

// In the seeds 4, 9 and 16, a particle that slides along a wall hits the lid in the same step as another
// particle. In seed 58, a particle reaches the floor shortly after the end of a step.
TEST(ParticlesAndJoints, AGasUnderARailedLidKeepsItsEnergyInLongSteps) {
  for (const uint64_t seed : {4, 5, 9, 16, 58})
    EXPECT_LT(gas_drift(true, true, 1.0 / 60, 10, seed), 1e-3) << seed;
}

}  // namespace
}  // namespace offstage::sim
