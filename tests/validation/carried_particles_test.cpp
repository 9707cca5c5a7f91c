/// Particles that collide with each other and rest on turning bodies.

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr Real kSpin = 2, kBall = 0.03, kTime = 5;

/// A turntable that keyframes or a motor turn, with a particle and a heap of four, all at rest on it.
struct Turntable {
  World world;
  BodyHandle table;
  ParticleSystemHandle system;
  bool rotates;

  Turntable(Real step, bool has_motor, bool has_balls)
      : world({.max_step = step, .sleep = false}), rotates(has_balls) {
    BodyDef def{.shape = Cylinder{1, 0.1}, .pose = {Vec3(0, -0.05, 0)}, .friction = 0.9};
    if (has_motor) {
      def.mass = 500;
      def.angular_velocity = {0, kSpin, 0};
    } else {
      def.motion = MotionType::kinematic;
      def.track.spin = {0, kSpin, 0};
    }
    table = world.add_body(def);
    if (has_motor)
      world.add_joint({.type = JointType::revolute,
                       .a = table,
                       .axis = Vec3::UnitY(),
                       .motor = {.mode = Motor::Mode::speed, .targets = {{0, kSpin}}}});
    system = world.add_particle_system({.internal = true, .rotates = rotates});
    add({0.5, 0});
    const Real side = 2 * kBall / std::sqrt(3.0);
    for (int k = 0; k < 3; ++k) {
      const Real angle = 2 * std::numbers::pi * k / 3;
      add({-0.5 + side * std::cos(angle), side * std::sin(angle)});
    }
    add({-0.5, 0}, 2 * kBall * std::sqrt(2.0 / 3.0));
  }
  void add(const Eigen::Vector2d& at, Real height = 0) {
    const Vec3 x(at.x(), kBall + height, at.y()), spin(0, kSpin, 0);
    world.add_particle(system, {.position = x,
                                .velocity = spin.cross(x),
                                .mass = 0.1,
                                .radius = kBall,
                                .restitution = 0,
                                .friction = 0.9,
                                .angular_velocity = rotates ? spin : Vec3(Vec3::Zero())});
  }
};

// Moved by the velocities at the ends of the sub-steps, they would come nearer to the axis by the fraction
// w^2 h / 2 in a second: by 20 mm in 5 s at 1/240 s.
TEST(CarriedParticles, StayWhereTheyAreOnATurntable) {
  for (const bool has_motor : {false, true})
    for (const auto& [step, most] : {std::pair{1.0 / 240, 2e-4}, {1.0 / 60, 2e-3}}) {
      Turntable t(step, has_motor, false);
      const auto distance = [&](std::size_t i) {
        const Vec3& x = t.world.particles(t.system).position[i];
        return std::hypot(x.x(), x.z());
      };
      std::vector<Real> before;
      for (std::size_t i = 0; i < 5; ++i) before.push_back(distance(i));
      for (int i = 0; i < 60 * kTime; ++i) t.world.step(1.0 / 60);
      EXPECT_NEAR(distance(0), before[0], most / 10) << has_motor << ' ' << step;
      for (std::size_t i = 1; i < 5; ++i)
        EXPECT_NEAR(distance(i), before[i], most) << has_motor << ' ' << step;
    }
}

}  // namespace
}  // namespace offstage::sim
