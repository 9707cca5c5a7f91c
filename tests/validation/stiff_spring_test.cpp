/// Stiff springs: backward Euler where explicit integrators diverge, and adaptive steps for a temporary
/// stiffness.

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "sim/world.h"
#include "sim/world/coupled_system.h"

namespace offstage::sim {
namespace {

WorldDef implicit(const Vec3& gravity) {
  return {.gravity = gravity, .max_step = 1.0 / 30, .integrator = IntegratorKind::implicit_euler};
}

struct SpringRun {
  Real start = 0, end = 0, greatest_rise = 0;  // energies
  Real length = 0;                             // length of the spring at the end
};

/// Simulates ten seconds of a ball on a spring of rest length 1 m with k/m = 1e6 /s^2 at h = 1/30 s. So h^2
/// k/m = 1111, while explicit methods are stable only up to 4 or 8.
SpringRun swing(const Vec3& position, const Vec3& attachment) {
  World world(implicit(Vec3::Zero()));
  const auto ball = world.add_body({.shape = Sphere{0.1},
                                    .pose = {position},
                                    .velocity = {0.5, 2, 1},
                                    .angular_velocity = {1, 2, 3},
                                    .mass = 2,
                                    .collides = false});
  world.add_spring({.a = BodyPoint{ball, attachment}, .b = WorldPoint{}, .stiffness = 2e6, .rest_length = 1});
  SpringRun run{.start = world.energy().total()};
  Real before = run.start;
  for (int i = 0; i < 300; ++i) {
    EXPECT_TRUE(world.step(1.0 / 30).finite);
    run.end = world.energy().total();
    run.greatest_rise = std::fmax(run.greatest_rise, run.end - before);
    before = run.end;
  }
  run.length = world.body(ball).pose.point_to_world(attachment).norm();
  return run;
}

TEST(BackwardEuler, AStiffSpringNeverGainsEnergy) {
  for (const Vec3& start : {Vec3(1.5, 0, 0), Vec3(0.6, 0, 0), Vec3(1.2, 0.3, -0.2)}) {
    const SpringRun run = swing(start, Vec3::Zero());
    EXPECT_LE(run.greatest_rise, 1e-9 * run.start) << start.transpose();
    EXPECT_LT(run.end, 1e-3 * run.start);
    EXPECT_NEAR(run.length, 1, 1e-4);
  }
}

// A spring that is attached beside the centre rotates the ball. The work of its torque has an error of second
// order in h, so the small remaining energy may rise slightly.
TEST(BackwardEuler, AStiffSpringBesideTheCentreStaysStable) {
  for (const Vec3& start : {Vec3(1.5, 0, 0), Vec3(0.6, 0, 0), Vec3(1.2, 0.3, -0.2)}) {
    const SpringRun run = swing(start, {0.05, 0, 0.05});
    EXPECT_LE(run.greatest_rise, 1e-6 * run.start) << start.transpose();
    EXPECT_LT(run.end, 1e-3 * run.start);
    EXPECT_NEAR(run.length, 1, 1e-4);
  }
}

// A rope of stiff springs swings down under gravity and finally hangs with the elongation that the weights
// give.
TEST(BackwardEuler, AStiffRopeSwingsDownAndHangs) {
  constexpr int kBeads = 20;
  constexpr Real kMass = 0.1, kStiffness = 1e5, kLength = 0.1;
  World world(implicit({0, -9.81, 0}));
  const auto beads = world.add_particle_system({.linear_drag = 0.05});
  Attachment above = WorldPoint{};
  for (int i = 1; i <= kBeads; ++i) {
    const uint64_t id = world.add_particle(beads, {.position = {i * kLength, 0, 0}, .mass = kMass});
    const Attachment bead = ParticlePoint{beads, id};
    world.add_spring({.a = above, .b = bead, .stiffness = kStiffness});
    above = bead;
  }
  const Real start = world.energy().total();
  Real before = start;
  for (int i = 0; i < 30 * 20; ++i) {
    ASSERT_TRUE(world.step(1.0 / 30).finite);
    const Real now = world.energy().total();
    ASSERT_LE(now, before + 1e-9) << i;
    before = now;
  }
  Real bottom = 0;
  for (int i = 1; i <= kBeads; ++i) bottom += kLength + (kBeads + 1 - i) * kMass * 9.81 / kStiffness;
  const Vec3 end = world.particles(beads).position.back();
  EXPECT_NEAR(end.y(), -bottom, 1e-3);
  EXPECT_NEAR(std::hypot(end.x(), end.z()), 0, 0.05);
}

TEST(BackwardEuler, NewtonNeedsFewIterationsAndNoFallback) {
  WorldState world;
  world.def.gravity = {0, -9.81, 0};
  std::vector<BodyHandle> bodies;
  for (int i = 0; i < 30; ++i) {
    auto body = std::make_unique<Body>();
    body->rigid.mass = 0.5;
    body->rigid.inertia = Vec3(0.01, 0.02, 0.03).asDiagonal();
    body->rigid.inverse_inertia = body->rigid.inertia.inverse();
    body->rigid.position = {i + 1.0, 0, 0};
    bodies.push_back(world.bodies.insert(std::move(body)));
    const Attachment before = i > 0 ? Attachment(BodyPoint{bodies[bodies.size() - 2], {0.4, 0, 0}})
                                    : Attachment(WorldPoint{{0.4, 0, 0}});
    world.springs.insert({{.a = before, .b = BodyPoint{bodies.back(), {-0.4, 0, 0}}, .stiffness = 5e5}, 0.2});
  }
  CoupledSystem system(world);
  for (int i = 0; i < 60; ++i) system.step(integrator(IntegratorKind::implicit_euler), i / 240.0, 1.0 / 240);
  EXPECT_EQ(system.report().missed, 0u);
  EXPECT_LE(system.report().rejected, 2u);
  EXPECT_LE(system.report().iterations, 8 * system.report().steps);
}

/// A damped, driven oscillator whose stiffness falls from 1e6 to 10 within a tenth of a second.
class Softening final : public DynamicSystem {
 public:
  static constexpr Real kTime = 2;

  void velocity(Real, std::span<const Real>, std::span<const Real> p, std::span<Real> dx) const override {
    dx[0] = p[0];
  }
  void force(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dp) const override {
    const Real s = 1 + 1e4 * t * t, k = 10 + 1e6 / (s * s), c = 3 + 400 / s;
    dp[0] = -k * x[0] - c * p[0] + 20;
  }
};

/// Positions at 20 equally spaced times, and the cost.
struct Course {
  std::array<Real, 20> x;
  IntegratorReport report;
};

Course course(IntegratorKind kind, Real tolerance, int substeps) {
  Course c;
  std::array<Real, 1> x = {0.1}, p = {0};
  IntegratorWorkspace work{.tolerance = tolerance};
  constexpr Real kH = Softening::kTime / 20;
  for (std::size_t i = 0; i < c.x.size(); ++i) {
    for (int k = 0; k < substeps; ++k)
      integrator(kind).step(Softening(), kH * (static_cast<Real>(i) + static_cast<Real>(k) / substeps),
                            kH / substeps, x, p, work);
    c.x[i] = x[0];
  }
  c.report = work.report;
  return c;
}

Real difference(const Course& a, const Course& b) {
  Real greatest = 0;
  for (std::size_t i = 0; i < a.x.size(); ++i) greatest = std::fmax(greatest, std::abs(a.x[i] - b.x[i]));
  return greatest;
}

// Damping removes earlier errors, so the whole solution stays within the tolerance of one step; the thousands
// of short steps of Euler's method accumulate slightly more.
TEST(AdaptiveStep, MeetsTheToleranceWithFewerEvaluationsThanFixedSteps) {
  const Course exact = course(IntegratorKind::rk4, 0, 20000);
  struct Case {
    IntegratorKind adaptive, fixed;
    Real target, accumulated;
  };
  for (const Case& c : {Case{IntegratorKind::adaptive_euler, IntegratorKind::explicit_euler, 1e-4, 3},
                        Case{IntegratorKind::adaptive_midpoint, IntegratorKind::midpoint, 1e-6, 1},
                        Case{IntegratorKind::adaptive_rk4, IntegratorKind::rk4, 1e-7, 1},
                        Case{IntegratorKind::dormand_prince, IntegratorKind::rk4, 1e-7, 1}}) {
    const Course adaptive = course(c.adaptive, c.target, 1);
    const Real error = difference(adaptive, exact);
    EXPECT_LT(error, c.accumulated * c.target) << static_cast<int>(c.adaptive);
    EXPECT_EQ(adaptive.report.missed, 0u);
    // The smallest number of fixed steps, to within a quarter, that is as accurate.
    int substeps = 10;
    while (!(difference(course(c.fixed, 0, substeps), exact) <= error) && substeps < 20000)
      substeps += substeps / 4 + 1;
    EXPECT_LT(adaptive.report.evaluations, course(c.fixed, 0, substeps).report.evaluations / 2)
        << static_cast<int>(c.adaptive);
  }
}

}  // namespace
}  // namespace offstage::sim
