/// Motion without contact, compared with closed forms.

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr std::array kAllKinds = {IntegratorKind::explicit_euler, IntegratorKind::symplectic_euler,
                                  IntegratorKind::leapfrog, IntegratorKind::midpoint, IntegratorKind::rk4};

struct Fall {
  Vec3 position, velocity;
};

Fall particle_fall(IntegratorKind kind, Real drag, int steps, Real time) {
  World world({.max_step = time / steps, .bounds = Aabb(Vec3::Constant(-1e4), Vec3::Constant(1e4))});
  const auto system = world.add_particle_system({.linear_drag = drag, .integrator = kind});
  world.add_particle(system, {.velocity = {3, 4, 0}, .mass = 2});
  world.step(time);
  return {world.particles(system).position[0], world.particles(system).velocity[0]};
}

// v(t) = v_t + (v0 - v_t) e^(-t/tau), x(t) = v_t t + (v0 - v_t) tau (1 - e^(-t/tau)), v_t = m g / k, tau = m
// / k.
Fall exact_fall(Real drag, Real t) {
  const Real tau = 2 / drag, decay = std::exp(-t / tau);
  const Vec3 v0(3, 4, 0), terminal = tau * Vec3(0, -9.81, 0);
  return {terminal * t + (v0 - terminal) * tau * (1 - decay), terminal + (v0 - terminal) * decay};
}

TEST(FreeFall, WithoutDragTheHigherOrdersAreExactAndTheFirstOrdersAreOffByHalfAStep) {
  const Vec3 exact = 2 * Vec3(3, 4, 0) + 2 * Vec3(0, -9.81, 0);
  const Real h = 2.0 / 480;
  const Vec3 half_step = Vec3(0, -9.81, 0) * h;  // g t h / 2
  for (auto kind : {IntegratorKind::leapfrog, IntegratorKind::midpoint, IntegratorKind::rk4})
    EXPECT_NEAR((particle_fall(kind, 0, 480, 2).position - exact).norm(), 0, 1e-11);
  EXPECT_NEAR(
      (particle_fall(IntegratorKind::explicit_euler, 0, 480, 2).position - (exact - half_step)).norm(), 0,
      1e-11);
  EXPECT_NEAR(
      (particle_fall(IntegratorKind::symplectic_euler, 0, 480, 2).position - (exact + half_step)).norm(), 0,
      1e-11);
}

TEST(FreeFall, ErrorFallsWithTheOrderOfTheIntegrator) {
  constexpr std::array kExpected = {1.0, 1.0, 2.0, 2.0, 4.0};
  for (std::size_t i = 0; i < kAllKinds.size(); ++i) {
    const auto error = [&](int steps) {
      return (particle_fall(kAllKinds[i], 3, steps, 2).position - exact_fall(3, 2).position).norm();
    };
    EXPECT_NEAR(std::log2(error(80) / error(160)), kExpected[i], 0.1) << "integrator " << i;
  }
}

// With a force field, the integrator uses its general form.
TEST(LinearDrag, TheDefaultIsOfSecondOrderInMovingAirToo) {
  const auto fall = [](int steps) {
    World world({.max_step = 2.0 / steps, .bounds = Aabb(Vec3::Constant(-1e4), Vec3::Constant(1e4))});
    const auto system = world.add_particle_system({});
    world.add_force({.systems = {system}, .effect = WindField{.drag = 3}});
    world.add_particle(system, {.velocity = {3, 4, 0}, .mass = 2});
    world.step(2);
    return (world.particles(system).position[0] - exact_fall(3, 2).position).norm();
  };
  EXPECT_NEAR(std::log2(fall(80) / fall(160)), 2, 0.1);
}

// The explicit methods would diverge.
TEST(LinearDrag, TheDefaultReachesTheTerminalVelocityForAnyDrag) {
  for (const Real drag : {30.0, 3e3, 3e6}) {
    const Fall computed = particle_fall(ParticleSystemDef{}.integrator, drag, 20, 2);
    const Fall exact = exact_fall(drag, 2);
    EXPECT_NEAR((computed.velocity - exact.velocity).norm(), 0, 1e-2 * exact.velocity.norm()) << drag;
    EXPECT_NEAR((computed.position - exact.position).norm(), 0, 0.1 * exact.position.norm() + 1e-3) << drag;
  }
}

// A first-order method falls short by 0.9 % at 1/240 s, and by 3.8 % at 1/60 s.
// A force that begins and ends with a sub-step acts for exactly this time: F t = m v.
TEST(Pulse, GivesItsWholeImpulseWithEveryIntegrator) {
  for (const IntegratorKind kind :
       {IntegratorKind::explicit_euler, IntegratorKind::symplectic_euler, IntegratorKind::midpoint,
        IntegratorKind::rk4, IntegratorKind::implicit_euler, IntegratorKind::dormand_prince}) {
    World world({.gravity = Vec3::Zero(), .max_step = 1.0 / 60, .integrator = kind});
    const BodyHandle body = world.add_body({.shape = Sphere{0.1}, .mass = 2});
    const BodyHandle pushed = world.add_body({.shape = Sphere{0.1}, .pose = {Vec3(0, 2, 0)}, .mass = 2});
    const ParticleSystemHandle particles = world.add_particle_system({.integrator = kind});
    world.add_particle(particles, {.position = Vec3(0, 4, 0), .mass = 2});
    world.add_force({.name = "pulse",
                     .bodies = {body},
                     .systems = {particles},
                     .start = 0.5,
                     .end = 1,
                     .effect = ConstantField{.force = Vec3(3, 0, 0)}});
    AppliedForce steps;
    steps.keys = {{0, Vec3::Zero(), Vec3::Zero(), Interpolation::step},
                  {0.5, Vec3(3, 0, 0), Vec3::Zero(), Interpolation::step},
                  {1, Vec3::Zero(), Vec3::Zero(), Interpolation::step}};
    world.add_force({.name = "steps", .bodies = {pushed}, .effect = steps});
    for (int i = 0; i < 90; ++i) world.step(1.0 / 60);
    EXPECT_NEAR(world.body(body).velocity.x(), 0.75, 1e-12) << static_cast<int>(kind);
    EXPECT_NEAR(world.body(pushed).velocity.x(), 0.75, 1e-12) << static_cast<int>(kind);
    EXPECT_NEAR(world.particles(particles).velocity[0].x(), 0.75, 1e-12) << static_cast<int>(kind);
  }
}

TEST(Fountain, HasTheRangeOfItsParabolaAtAnyStep) {
  for (const Real step : {1.0 / 240, 1.0 / 60}) {
    World world({.max_step = step});
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0, .friction = 1e6});
    const auto jet = world.add_particle_system({.dies_on_hit = true, .report_collisions = true});
    world.add_particle(jet, {.position = {0, 0.01, 0}, .velocity = {3, 8, 0}, .radius = 0.01});
    Real reach = 0;
    for (Real t = 0; t < 3 && world.particle_count() > 0; t += step) {
      world.step(step);
      for (const ParticleEvent& e : world.particle_events()) reach = e.position.x();
    }
    EXPECT_NEAR(reach / (2 * 3 * 8 / 9.81), 1, 2e-4) << step;
  }
}

TEST(LinearDrag, VelocityApproachesTheTerminalOneAtTheRightRate) {
  for (Real t : {0.25, 1.0, 2.0}) {
    const Fall computed = particle_fall(IntegratorKind::rk4, 3, static_cast<int>(t * 240), t);
    EXPECT_NEAR((computed.velocity - exact_fall(3, t).velocity).norm() / exact_fall(3, t).velocity.norm(), 0,
                1e-9);
  }
}

TEST(Rain, ReachesItsTerminalSpeedRelativeToTheWind) {
  constexpr Real kMass = 4e-6, kDrag = 5e-6;
  World world({.wind = {2, 0, 1}, .bounds = Aabb(Vec3::Constant(-1e4), Vec3::Constant(1e4))});
  const auto rain = world.add_particle_system({.linear_drag = kDrag});
  world.add_particle(rain, {.mass = kMass, .radius = 0.001});
  for (int i = 0; i < 600; ++i) world.step(1.0 / 60);
  EXPECT_NEAR((world.particles(rain).velocity[0] - Vec3(2, -kMass * 9.81 / kDrag, 1)).norm(), 0, 1e-3);
}

/// Two bodies under mutual gravitation, as a DynamicSystem defined by the test.
class Kepler final : public DynamicSystem {
 public:
  static constexpr Real kG = 1, kM1 = 3, kM2 = 1;

  void velocity(Real, std::span<const Real>, std::span<const Real> p, std::span<Real> dx) const override {
    for (int i = 0; i < 3; ++i) {
      dx[i] = p[i] / kM1;
      dx[3 + i] = p[3 + i] / kM2;
    }
  }
  void force(Real, std::span<const Real> x, std::span<const Real>, std::span<Real> dp) const override {
    const Vec3 d(x[3] - x[0], x[4] - x[1], x[5] - x[2]);
    const Vec3 f = kG * kM1 * kM2 * d / std::pow(d.norm(), 3);
    for (int i = 0; i < 3; ++i) {
      dp[i] = f[i];
      dp[3 + i] = -f[i];
    }
  }
  static Real energy(std::span<const Real> x, std::span<const Real> p) {
    const Vec3 d(x[3] - x[0], x[4] - x[1], x[5] - x[2]), p1(p[0], p[1], p[2]), p2(p[3], p[4], p[5]);
    return p1.squaredNorm() / (2 * kM1) + p2.squaredNorm() / (2 * kM2) - kG * kM1 * kM2 / d.norm();
  }
};

TEST(Kepler, EccentricOrbitClosesOnItselfForTenPeriods) {
  // The orbit starts at the apocentre r = a (1 + e), with the momentum of the reduced mass along y.
  constexpr Real kA = 1, kE = 0.3;
  const Real total = Kepler::kM1 + Kepler::kM2, mu = Kepler::kM1 * Kepler::kM2 / total, r = kA * (1 + kE);
  const Real speed = std::sqrt(Kepler::kG * total * (2 / r - 1 / kA));
  std::array<Real, 6> x = {-r * Kepler::kM2 / total, 0, 0, r * Kepler::kM1 / total, 0, 0};
  std::array<Real, 6> p = {0, -mu * speed, 0, 0, mu * speed, 0};
  const auto x0 = x;
  const Real e0 = Kepler::energy(x, p), period = 2 * M_PI * std::sqrt(kA * kA * kA / (Kepler::kG * total));
  IntegratorWorkspace work;
  constexpr int kSteps = 1000;
  for (int i = 0; i < 10 * kSteps; ++i) {
    integrator(IntegratorKind::rk4).step(Kepler(), 0, period / kSteps, x, p, work);
    ASSERT_NEAR(Kepler::energy(x, p) / e0, 1, 1e-4);
  }
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(x[i], x0[i], 1e-4);
}

// w0 = 10, damping ratio 0.1: x = e^(-a t) (cos wt + a/w sin wt).
TEST(Spring, PeriodAndDampingOfAParticleOnASpring) {
  World world({.gravity = Vec3::Zero()});
  const auto system = world.add_particle_system({.linear_drag = 0});
  const uint64_t id = world.add_particle(system, {.position = {1.5, 0, 0}, .mass = 2});
  world.add_spring(
      {.a = ParticlePoint{system, id}, .b = WorldPoint{}, .stiffness = 200, .damping = 4, .rest_length = 1});
  const Real a = 4.0 / (2 * 2), w = std::sqrt(200.0 / 2 - a * a);
  for (int i = 1; i <= 240; ++i) {
    world.step(1.0 / 120);
    const Real t = world.time(), x = 1 + 0.5 * std::exp(-a * t) * (std::cos(w * t) + a / w * std::sin(w * t));
    ASSERT_NEAR(world.particles(system).position[0].x(), x, 2e-6) << t;
  }
}

// Two bodies of equal mass: the reduced mass is half of each mass.
TEST(Spring, TwoBodiesOscillateWithTheReducedMassAndKeepTheirMomentum) {
  World world({.gravity = Vec3::Zero()});
  const auto left =
      world.add_body({.shape = Sphere{0.1}, .pose = {Vec3(-1.25, 0, 0)}, .velocity = {0, 1, 0}, .mass = 3});
  const auto right =
      world.add_body({.shape = Sphere{0.1}, .pose = {Vec3(1.25, 0, 0)}, .velocity = {0, 1, 0}, .mass = 3});
  world.add_spring({.a = BodyPoint{left}, .b = BodyPoint{right}, .stiffness = 60, .rest_length = 2});
  const Energy before = world.energy();
  const Real w = std::sqrt(60 / 1.5);
  for (int i = 0; i < 240; ++i) {
    world.step(1.0 / 120);
    const Vec3 a = world.body(left).centre, b = world.body(right).centre;
    ASSERT_NEAR(b.x() - a.x(), 2 + 0.5 * std::cos(w * world.time()), 1e-6);
    ASSERT_NEAR(a.y(), world.time(), 1e-12);
  }
  EXPECT_NEAR(world.energy().total(), before.total(), 1e-6 * before.total());
}

TEST(Spring, AnOffsetAttachmentTurnsTheBodyAndEnergyIsKept) {
  World world({.max_step = 1.0 / 960});
  const auto body = world.add_body({.shape = Box{{0.4, 0.1, 0.2}}, .density = 500});
  world.add_spring({.a = BodyPoint{body, {0.2, 0.05, 0.1}}, .b = WorldPoint{{0.2, 1, 0}}, .stiffness = 40});
  const Real before = world.energy().total();
  Real fastest = 0;
  for (int i = 0; i < 120; ++i) {
    world.step(1.0 / 60);
    fastest = std::max(fastest, world.body(body).angular_velocity.norm());
    ASSERT_NEAR(world.energy().total(), before, 1e-4 * 0.4 * 9.81);
  }
  EXPECT_GT(fastest, 1);
}

}  // namespace
}  // namespace offstage::sim
