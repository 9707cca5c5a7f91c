/// Particles that contacts turn: solid balls, I = 2/5 m r^2 (physics P9).

#include <cmath>

#include <gtest/gtest.h>

#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr Real kRotationFrame = 1.0 / 60, kBallRadius = 0.01;

class RotatingParticles : public testing::TestWithParam<ParticleContactMethod> {
 protected:
  World world_{{.max_step = kRotationFrame / 8, .particle_contacts = GetParam()}};
  ParticleSystemHandle balls_ = world_.add_particle_system({.internal = true, .rotates = true});

  void add_plane(const Quat& tilt, Real friction) {
    world_.add_body({.shape = Plane{},
                     .motion = MotionType::static_body,
                     .pose = {Vec3::Zero(), tilt},
                     .restitution = 0,
                     .friction = friction});
  }
  void add_ball(const Vec3& position, const Vec3& velocity, Real friction, Real restitution = 0) {
    world_.add_particle(balls_, {.position = position,
                                 .velocity = velocity,
                                 .mass = 0.1,
                                 .radius = kBallRadius,
                                 .restitution = restitution,
                                 .friction = friction});
  }
  const ParticleArrays& state() const { return world_.particles(balls_); }
  void run(Real time) {
    const int frames = static_cast<int>(std::lround(time / kRotationFrame));
    for (int i = 0; i < frames; ++i) world_.step(kRotationFrame);
  }
};

// Friction decelerates the ball by mu g and spins it up by 5/2 mu g / r, until it rolls at 5/7 of its speed.
TEST_P(RotatingParticles, SlideUntilTheyRollAtFiveSeventhsOfTheirSpeed) {
  constexpr Real kMu = 0.3, kSpeed = 1.4;
  add_plane(Quat::Identity(), kMu);
  add_ball({0, kBallRadius, 0}, {kSpeed, 0, 0}, kMu);
  const Real rolls_at = 2 * kSpeed / (7 * kMu * 9.81);
  run(0.1);
  ASSERT_LT(0.1, rolls_at);
  EXPECT_NEAR(state().velocity[0].x(), kSpeed - kMu * 9.81 * 0.1, 1e-3);
  EXPECT_NEAR(-state().angular_velocity[0].z() * kBallRadius, 2.5 * kMu * 9.81 * 0.1, 3e-3);
  run(0.5);
  EXPECT_NEAR(state().velocity[0].x(), 5.0 / 7 * kSpeed, 1e-3);
  EXPECT_NEAR(-state().angular_velocity[0].z() * kBallRadius, state().velocity[0].x(), 1e-4);
  // The orientation is the integral of the angular velocity.
  EXPECT_NEAR(state().orientation[0].norm(), 1, 1e-12);
}

TEST_P(RotatingParticles, RollDownAnInclineWithFiveSeventhsOfTheAcceleration) {
  constexpr Real kAngle = 0.3;
  const Quat tilt(Eigen::AngleAxisd(-kAngle, Vec3::UnitZ()));
  add_plane(tilt, 0.5);
  const Vec3 start = tilt * Vec3(0, kBallRadius, 0);
  add_ball(start, Vec3::Zero(), 0.5);
  run(1);
  const Real way = 5.0 / 7 * 9.81 * std::sin(kAngle) / 2;
  EXPECT_NEAR((state().position[0] - start).norm(), way, 0.01 * way);
}

// An oblique hit keeps momentum and angular momentum. With enough friction it leaves the surfaces at rest
// against each other: the effective mass across the normal is 2/7 of that along it, and this fraction of the
// energy of sliding is lost.
TEST_P(RotatingParticles, KeepMomentumAndAngularMomentumInAHit) {
  world_ = World({.gravity = Vec3::Zero(), .max_step = kRotationFrame / 8, .particle_contacts = GetParam()});
  balls_ = world_.add_particle_system({.internal = true, .rotates = true});
  add_ball({-0.05, 0, 0}, {2, 0.4, 0}, 1, 0.5);
  add_ball({0.05, 0.0, 0}, {-2, -0.4, 0}, 1, 0.5);
  const auto angular_momentum = [&] {
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < 2; ++i)
      sum += state().mass[i] * (state().position[i].cross(state().velocity[i]) +
                                0.4 * kBallRadius * kBallRadius * state().angular_velocity[i]);
    return sum;
  };
  const Vec3 before = angular_momentum();
  const Real energy = world_.energy().kinetic;
  run(0.2);
  EXPECT_NEAR((state().velocity[0] + state().velocity[1]).norm(), 0, 1e-12);
  EXPECT_NEAR((angular_momentum() - before).norm(), 0, 1e-9);
  const Vec3 d(-0.1, 0, 0), u(4, 0.8, 0);
  const Vec3 n = (d + *meeting_time(d, u, 2 * kBallRadius) * u) / (2 * kBallRadius);
  const Real approach = -u.dot(n), across2 = u.squaredNorm() - approach * approach, m12 = 0.05;
  EXPECT_NEAR(world_.energy().kinetic, energy - m12 / 2 * (0.75 * approach * approach + 2.0 / 7 * across2),
              1e-9);
  EXPECT_NEAR((state().velocity[0] - state().velocity[1]).dot(n), approach / 2, 1e-9);
  EXPECT_NEAR((state().angular_velocity[0] - state().angular_velocity[1]).norm(), 0, 1e-9);
}

// Without `rotates`, a ball does not turn and stops by sliding.
TEST(Particles, DoNotTurnUnlessTheyRotate) {
  World world({.max_step = kRotationFrame});
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0, .friction = 0.3});
  const auto system = world.add_particle_system({.internal = true});
  world.add_particle(system,
                     {.position = {0, 0.01, 0}, .velocity = {1, 0, 0}, .restitution = 0, .friction = 0.3});
  for (int i = 0; i < 60; ++i) world.step(kRotationFrame);
  EXPECT_TRUE(world.particles(system).angular_velocity.empty());
  EXPECT_NEAR(world.particles(system).velocity[0].norm(), 0, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Methods, RotatingParticles,
                         testing::Values(ParticleContactMethod::relaxation, ParticleContactMethod::lcp));

}  // namespace
}  // namespace offstage::sim
