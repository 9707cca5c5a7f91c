/// Particles that rest on bodies: the bodies carry their weight, on springs, joints and floors, also where
/// the particles are heavier than the body (physics P8).

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr Real kWeightPerMass = 9.81, kPlateMass = 1, kBeadRadius = 0.012;

/// A plate with nine beads on it.
struct Scale {
  World world;
  BodyHandle plate;
  ParticleSystemHandle beads;

  /// `beads_mass`: mass of all beads [kg]. They start `height` [m] above the plate, whose top is at y = 0.
  /// `internal`: whether they collide with each other.
  Scale(Real step, Real beads_mass, bool internal, Real height = 0, Real lifespan = 1e9, bool sleep = false)
      : world({.max_step = step, .sleep = sleep}) {
    plate = world.add_body({.name = "plate",
                            .shape = Box{{0.3, 0.02, 0.3}},
                            .pose = {Vec3(0, -0.01, 0)},
                            .mass = kPlateMass,
                            .restitution = 0,
                            .friction = 0.3});
    beads = world.add_particle_system({.internal = internal});
    for (int i = 0; i < 9; ++i)
      world.add_particle(beads, {.position = {0.06 * (i % 3 - 1), kBeadRadius + height, 0.06 * (i / 3 - 1)},
                                 .mass = beads_mass / 9,
                                 .radius = kBeadRadius,
                                 .lifespan = lifespan,
                                 .restitution = 0,
                                 .friction = 0.3});
  }
  /// A spring from the plate's centre to a point 1 m above, which is relaxed at a plate `below` [m] lower.
  void hang(Real stiffness, Real damping, Real below = 0) {
    world.add_spring({.a = BodyPoint{plate, Vec3::Zero()},
                      .b = WorldPoint{Vec3(0, 0.99, 0)},
                      .stiffness = stiffness,
                      .damping = damping,
                      .rest_length = 1 + below});
  }
  void guide() {
    world.add_joint({.name = "rail", .type = JointType::prismatic, .a = plate, .axis = Vec3::UnitY()});
  }
  void add_floor() {
    world.add_body({.name = "floor",
                    .shape = Box{{4, 1, 4}},
                    .motion = MotionType::static_body,
                    .pose = {Vec3(0, -0.52, 0)},
                    .friction = 0.5});
  }
  void run(Real seconds) {
    for (int i = 0; i < std::lround(seconds * 60); ++i) world.step(1.0 / 60);
  }
  /// Height of the plate's top [m].
  Real height() const { return world.body(plate).centre.y() + 0.01; }
  Real force_on_floor() const {
    Real sum = 0;
    for (const ContactState& c : world.contacts()) sum += std::abs(c.force.y());
    return sum;
  }
};

struct ScaleCase {
  Real step, mass;
  bool internal;
};
class ParticleLoads : public testing::TestWithParam<ScaleCase> {};

// The spring sags by the weight of plate and beads. Forces of resting particles reach the body within the
// sub-step. As impulses at its end, they left a plate under twice its mass jumping at 0.2 m/s.
TEST_P(ParticleLoads, StretchASpringByTheirWeight) {
  const auto [step, mass, internal] = GetParam();
  for (const bool is_guided : {false, true}) {
    Scale scale(step, mass, internal);
    const Real sag = 0.04, stiffness = (kPlateMass + mass) * kWeightPerMass / sag;
    if (is_guided) scale.guide();
    scale.hang(stiffness, std::sqrt(stiffness * (kPlateMass + mass)));
    scale.run(6);
    EXPECT_NEAR(scale.height(), -sag, 1e-4 * sag) << "guided: " << is_guided;
    EXPECT_LT(scale.world.body(scale.plate).velocity.norm(), 1e-5);
    for (const Vec3& x : scale.world.particles(scale.beads).position)
      EXPECT_NEAR(x.y() - kBeadRadius, scale.height(), 2e-5);
  }
}

// The floor carries the weight of both. The plate stays where it is as the beads fall onto it, and as they
// are removed.
TEST_P(ParticleLoads, PressALightPlateOnAFloor) {
  const auto [step, mass, internal] = GetParam();
  Scale scale(step, mass, internal, 0.1, 2);
  scale.add_floor();
  for (int i = 0; i < 120; ++i) {
    scale.run(1.0 / 60);
    EXPECT_NEAR(scale.height(), 0, 2e-6) << i;
  }
  EXPECT_NEAR(scale.force_on_floor(), (kPlateMass + mass) * kWeightPerMass, 1e-4 * mass * kWeightPerMass);
  for (int i = 0; i < 30; ++i) {
    scale.run(1.0 / 60);
    EXPECT_NEAR(scale.height(), 0, 1e-6) << i;
  }
  EXPECT_EQ(scale.world.particles(scale.beads).size(), 0u);
  EXPECT_NEAR(scale.force_on_floor(), kPlateMass * kWeightPerMass, 1e-4 * mass * kWeightPerMass);
}

INSTANTIATE_TEST_SUITE_P(All, ParticleLoads,
                         testing::Values(ScaleCase{1.0 / 240, 0.5, true}, ScaleCase{1.0 / 240, 2, true},
                                         ScaleCase{1.0 / 240, 20, true}, ScaleCase{1.0 / 60, 0.5, true},
                                         ScaleCase{1.0 / 60, 2, true}, ScaleCase{1.0 / 240, 0.5, false},
                                         ScaleCase{1.0 / 240, 2, false}, ScaleCase{1.0 / 240, 20, false},
                                         ScaleCase{1.0 / 60, 0.5, false}, ScaleCase{1.0 / 60, 2, false}));

// Plate and beads oscillate together, at sqrt(k / (m + M)).
TEST(ParticleLoad, TakesPartInOscillations) {
  for (const Real mass : {0.5, 2.0, 10.0}) {
    Scale scale(1.0 / 240, mass, true);
    const Real amplitude = 0.03, rate = 10, stiffness = rate * rate * (kPlateMass + mass);
    scale.guide();
    scale.hang(stiffness, 0, amplitude - kWeightPerMass / (rate * rate));
    std::vector<Real> crossings;  // times at which the plate rises through its position of equilibrium
    for (Real before = amplitude; scale.world.time() < 4;) {
      scale.world.step(1.0 / 240);
      const Real now = scale.height() + amplitude;
      if (before < 0 && now >= 0) crossings.push_back(scale.world.time() - now / (now - before) / 240);
      before = now;
    }
    ASSERT_GT(crossings.size(), 4u);
    const Real periods = static_cast<Real>(crossings.size() - 1);
    EXPECT_NEAR((crossings.back() - crossings.front()) / periods, 2 * std::numbers::pi / rate, 2e-4) << mass;
  }
}

// The load moves all links of a chain together. When only the plate moved, the force on the upper hook
// changed by a third from sub-step to sub-step.
TEST(ParticleLoad, PullsAtAChainOfLinks) {
  Scale scale(1.0 / 240, 5, true);
  const auto link = scale.world.add_body({.name = "link",
                                          .shape = Box{{0.02, 0.2, 0.02}},
                                          .pose = {Vec3(0, 0.3, 0)},
                                          .mass = 0.1,
                                          .collides = false});
  const auto hook = scale.world.add_joint({.name = "upper",
                                           .type = JointType::revolute,
                                           .a = link,
                                           .anchor = {0, 0.4, 0},
                                           .axis = Vec3::UnitZ(),
                                           .damping = 0.5});
  scale.world.add_joint({.name = "lower",
                         .type = JointType::revolute,
                         .a = scale.plate,
                         .b = link,
                         .anchor = {0, 0.2, 0},
                         .axis = Vec3::UnitZ(),
                         .damping = 0.5});
  scale.run(3);
  for (int i = 0; i < 60; ++i) {
    scale.world.step(1.0 / 240);
    EXPECT_NEAR(scale.world.joint(hook).force.y(), (kPlateMass + 0.1 + 5) * kWeightPerMass, 0.05) << i;
  }
}

// Dry friction of a vertical rail, or a motor at rest, holds plate and beads. When default particles acted by
// impulses between the solutions of the joint, the plate crept by 1 cm/s.
TEST(ParticleLoad, DoesNotMoveAPlateThatAJointHolds) {
  for (const Real step : {1.0 / 240, 1.0 / 60})
    for (const bool internal : {false, true})
      for (const bool has_motor : {false, true}) {
        constexpr Real kBeads = 0.5, kHold = 7 * (kPlateMass + kBeads) * kWeightPerMass;
        Scale scale(step, kBeads, internal);
        JointDef rail{.name = "rail", .type = JointType::prismatic, .a = scale.plate, .axis = Vec3::UnitY()};
        if (has_motor)
          rail.motor = {.mode = Motor::Mode::speed, .max_effort = kHold};
        else
          rail.friction = kHold;
        scale.world.add_joint(rail);
        scale.run(2);
        const Real before = scale.height();
        scale.run(4);
        EXPECT_NEAR(scale.height(), before, 1e-6) << "step " << step << " internal " << internal;
        EXPECT_NEAR(before, 0, 2 * kWeightPerMass * step * step)
            << "step " << step << " internal " << internal;
      }
}

// A sleeping body carries the particles on it, and does not wake again and again.
TEST(ParticleLoad, DoesNotWakeABody) {
  for (const bool internal : {false, true}) {
    Scale scale(1.0 / 240, 0.5, internal, 0.05, 1e9, true);
    scale.add_floor();
    scale.run(3);
    for (int i = 0; i < 300; ++i) {
      scale.run(1.0 / 60);
      EXPECT_TRUE(scale.world.is_asleep(scale.plate)) << i << " internal " << internal;
    }
  }
}

}  // namespace
}  // namespace offstage::sim
