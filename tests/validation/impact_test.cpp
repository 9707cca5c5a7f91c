/// Bouncing bodies: balls, oblique impacts, elastic pairs, Newton's cradle, paddles, and endless sequences of
/// impacts, all with the full simulation.

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/convex_samples.h"
#include "tests/validation/both_solvers.h"

namespace offstage::sim {
namespace {

constexpr Real kImpactGravity = 9.81;

class BallDrop : public BothSolvers {
 protected:
  struct Drop {
    std::vector<Real> apexes;
    Real rest_height;
    Tally tally;
  };
  static Drop drop(Real e, Real max_step, Real seconds) {
    constexpr Real kRadius = 0.05;
    World world(def(max_step));
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = e});
    const auto ball =
        world.add_body({.shape = Sphere{kRadius}, .pose = {Vec3(0, 1 + kRadius, 0)}, .restitution = e});
    Drop d;
    Real last_v = 0;
    while (world.time() < seconds) {
      d.tally.add(world.step(max_step));
      const BodyState s = world.body(ball);
      const Real y = s.centre.y() - kRadius, v = s.velocity.y();
      // The apex of the parabola, from any point on it.
      if (last_v > 0 && v <= 0 && y > 1e-2) d.apexes.push_back(y + v * v / (2 * kImpactGravity));
      last_v = v;
    }
    d.rest_height = world.body(ball).centre.y() - kRadius;
    return d;
  }
};

TEST_P(BallDrop, ApexesFallWithTheSquareOfTheRestitution) {
  for (const Real max_step : {1.0 / 240, 1.0 / 60})
    for (const Real e : {1.0, 0.9, 0.5}) {
      const Drop d = drop(e, max_step, 4);
      const std::size_t count = e == 0.5 ? 3 : 4;
      ASSERT_GE(d.apexes.size(), count) << e;
      for (std::size_t k = 0; k < count; ++k)
        EXPECT_NEAR(d.apexes[k], std::pow(e, 2.0 * (Real(k) + 1)), 1e-3) << "e " << e << " step " << max_step;
    }
}

TEST_P(BallDrop, WithoutRestitutionItRestsAtOnceAndWithOneHalfEventually) {
  for (const Real max_step : {1.0 / 240, 1.0 / 60}) {
    const Drop dead = drop(0, max_step, 1);
    EXPECT_TRUE(dead.apexes.empty());
    EXPECT_NEAR(dead.rest_height, 0, 1e-3) << max_step;
    EXPECT_NEAR(drop(0.5, max_step, 4).rest_height, 0, 1e-3) << max_step;
  }
}

// The intervals between impacts shrink. The collision speed ends the sequence, and the number of impacts in a
// step is limited.
TEST_P(BallDrop, ImpactsWithoutEndTerminate) {
  const Drop d = drop(0.5, 1.0 / 30, 4);
  EXPECT_TRUE(d.tally.finite);
  EXPECT_GE(d.tally.tracebacks, 3u);
  EXPECT_LT(d.tally.tracebacks, 40u);
  EXPECT_EQ(d.tally.last.impacts.tracebacks, 0u);
  EXPECT_NEAR(d.rest_height, 0, 1e-3);
}
OFFSTAGE_BOTH_SOLVERS(Solvers, BallDrop);

class ObliqueBall : public BothSolvers {};

// A solid sphere sticks and rolls if mu (1 + e) u_n >= 2/7 u_t, and slides otherwise (P5). The contact point
// is half the contact distance outside the ball, which limits the accuracy of the rolling case.
TEST_P(ObliqueBall, SticksOrSlidesOnEitherSideOfTheCriticalFriction) {
  constexpr Real kRadius = 0.1, e = 0.5, kAcross = 2, kDown = 3;
  const Real critical = 2.0 / 7 * kAcross / ((1 + e) * kDown);
  for (const Real ratio : {0.0, 0.5, 0.999, 1.001, 2.0}) {
    const Real mu = ratio * critical;
    World world(weightless());
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0, .friction = mu});
    const auto ball = world.add_body({.shape = Sphere{kRadius},
                                      .pose = {Vec3(0, 0.2, 0)},
                                      .velocity = {kAcross, -kDown, 0},
                                      .restitution = e,
                                      .friction = mu});
    const Tally r = run(world, 0.1);
    EXPECT_EQ(r.collisions, 1u);
    const Real lost = std::min(2.0 / 7 * kAcross, mu * (1 + e) * kDown);
    const BodyState s = world.body(ball);
    EXPECT_NEAR(s.velocity.y(), e * kDown, 1e-12);
    EXPECT_NEAR(s.velocity.x(), kAcross - lost, ratio < 1 ? 1e-12 : 1e-4) << ratio;
    EXPECT_NEAR(s.velocity.z(), 0, 1e-12);
    EXPECT_NEAR(s.angular_velocity.z(), -2.5 * lost / kRadius, 2e-4 * lost / kRadius) << ratio;
  }
}
OFFSTAGE_BOTH_SOLVERS(Solvers, ObliqueBall);

class ElasticPair : public BothSolvers {
 protected:
  struct Sum {
    Vec3 momentum = Vec3::Zero(), angular = Vec3::Zero();
    Real energy;
  };
  static Sum sum(const World& world, std::initializer_list<BodyHandle> bodies) {
    Sum t;
    for (const BodyHandle b : bodies) {
      const BodyState s = world.body(b);
      t.momentum += s.mass * s.velocity;
      t.angular += s.centre.cross(s.mass * s.velocity) + s.angular_momentum;
    }
    t.energy = world.energy().total();
    return t;
  }
  static void expect_kept(const Sum& before, const Sum& after, Real energy_tolerance) {
    EXPECT_LT((after.momentum - before.momentum).norm(), 1e-12 * before.energy);
    EXPECT_LT((after.angular - before.angular).norm(), 1e-12 * before.energy);
    EXPECT_NEAR(after.energy / before.energy, 1, energy_tolerance);
  }
};

TEST_P(ElasticPair, BallsKeepMomentumAngularMomentumAndEnergy) {
  Dice dice(11);
  for (int k = 0; k < 60; ++k) {
    World world(weightless());
    const Real ra = dice.uniform(0.02, 0.3), rb = dice.uniform(0.02, 0.3);
    const Vec3 way = dice.direction(), side = way.cross(dice.direction()).normalized();
    // From head-on to grazing impacts.
    const Vec3 at = 0.7 * way + dice.uniform(0, k % 2 == 0 ? 0 : 0.95 * (ra + rb)) * side;
    const auto ball = [&](Real r, const Vec3& p, const Vec3& v) {
      return world.add_body({.shape = Sphere{r},
                             .pose = {p},
                             .velocity = v,
                             .angular_velocity = 3 * dice.in_cube(),
                             .density = dice.uniform(100, 5000),
                             .restitution = 1,
                             .friction = 0});
    };
    const auto a = ball(ra, Vec3::Zero(), dice.uniform(1, 4) * way),
               b = ball(rb, at, -dice.uniform(0.5, 3) * way);
    const Sum before = sum(world, {a, b});
    EXPECT_EQ(run(world, 0.6).collisions, 1u);
    expect_kept(before, sum(world, {a, b}), 1e-12);
  }
}

// A box rotates after the impact, so its energy is as accurate as the integration of its free rotation.
TEST_P(ElasticPair, BoxesAndCapsulesKeepThemToo) {
  Dice dice(12);
  int hits = 0;
  for (int k = 0; k < 30; ++k) {
    World world(weightless());
    const auto body = [&](const Vec3& p, const Vec3& v) {
      const Shape shape = dice.chance(0.5) ? Shape(Box{Vec3::Constant(0.3) + 0.2 * dice.in_cube()})
                                           : Shape(Capsule{dice.uniform(0.05, 0.15), dice.uniform(0.1, 0.3)});
      return world.add_body(
          {.shape = shape, .pose = {p, dice.rotation()}, .velocity = v, .restitution = 1, .friction = 0});
    };
    const Vec3 way = dice.direction();
    const auto a = body(Vec3::Zero(), 2 * way), b = body(0.7 * way + 0.05 * dice.in_cube(), -1 * way);
    const Sum before = sum(world, {a, b});
    const Tally r = run(world, 0.4);
    hits += r.collisions > 0;
    EXPECT_TRUE(r.finite);
    expect_kept(before, sum(world, {a, b}), 1e-6);
  }
  EXPECT_EQ(hits, 30);
}
OFFSTAGE_BOTH_SOLVERS(Solvers, ElasticPair);

class Cradle : public BothSolvers {
 protected:
  /// Simulates five balls in a row, of which the first `moving` balls approach at 1 m/s. Returns the speeds
  /// after the impacts.
  static std::vector<Real> speeds(std::size_t moving, ImpactLaw law) {
    constexpr Real kRadius = 0.05;
    WorldDef def_ = weightless();
    def_.impact = law;
    World world(def_);
    std::vector<BodyHandle> balls;
    for (std::size_t i = 0; i < 5; ++i)
      balls.push_back(world.add_body({.shape = Sphere{kRadius},
                                      .pose = {Vec3(2 * kRadius * Real(i) - (i < moving ? 0.203 : 0), 0, 0)},
                                      .velocity = {i < moving ? 1.0 : 0.0, 0, 0},
                                      .restitution = 1,
                                      .friction = 0}));
    run(world, 0.5);
    std::vector<Real> v;
    for (const BodyHandle b : balls) v.push_back(world.body(b).velocity.x());
    return v;
  }
};

TEST_P(Cradle, SequentialImpactsEjectAsManyBallsAsArrive) {
  for (std::size_t moving = 1; moving < 5; ++moving) {
    const std::vector<Real> v = speeds(moving, ImpactLaw::sequential);
    for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(v[i], i < 5 - moving ? 0 : 1, 0.01) << moving << ' ' << i;
  }
}

// All contacts are resolved together, and contacts at rest may not close: the row of four balls leaves at one
// speed.
TEST_P(Cradle, SimultaneousImpactsMoveTheRowAsOneBody) {
  const std::vector<Real> v = speeds(1, ImpactLaw::simultaneous);
  EXPECT_NEAR(v[0], -0.6, 1e-8);
  for (std::size_t i = 1; i < 5; ++i) EXPECT_NEAR(v[i], 0.4, 1e-8);
}
OFFSTAGE_BOTH_SOLVERS(Solvers, Cradle);

class Paddle : public BothSolvers {};

TEST_P(Paddle, GivesABallTheSpeedOfItsSurfaceAndTheRestitution) {
  for (const Real e : {1.0, 0.4}) {
    World world(weightless());
    world.add_body({.shape = Box{{0.1, 1, 1}},
                    .motion = MotionType::kinematic,
                    .restitution = e,
                    .track = {.keys = {{0, {Vec3(0, 0, 0)}}, {1, {Vec3(2, 0, 0)}}},
                              .interpolation = Interpolation::linear}});
    const auto ball = world.add_body(
        {.shape = Sphere{0.1}, .pose = {Vec3(0.5, 0, 0)}, .velocity = {-1, 0, 0}, .restitution = e});
    run(world, 0.5);
    EXPECT_NEAR(world.body(ball).velocity.x(), 2 + e * 3, 1e-9);
  }
}

TEST_P(Paddle, ARotatingBatHitsWithItsVelocityAtTheContact) {
  World world(weightless());
  world.add_body({.shape = Box{{2, 0.1, 0.1}},
                  .motion = MotionType::kinematic,
                  .pose = {Vec3::Zero()},
                  .restitution = 0.8,
                  .friction = 0,
                  .track = {.spin = {0, 0, 4}}});
  // The ball is 0.3 rad ahead and will then touch the surface of the bat.
  const Vec3 along(std::cos(0.3), std::sin(0.3), 0), across(-along.y(), along.x(), 0);
  const auto ball = world.add_body(
      {.shape = Sphere{0.05}, .pose = {0.8 * along + 0.1 * across}, .restitution = 0, .friction = 0});
  run(world, 0.15);
  const Vec3 v = world.body(ball).velocity;
  EXPECT_NEAR((v - 1.8 * 4 * 0.8 * across).norm(), 0, 1e-3);
}

TEST_P(Paddle, ABoxPushesAStackAlong) {
  World world(def());
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  const auto pusher =
      world.add_body({.shape = Box{{0.2, 0.18, 0.4}},
                      .motion = MotionType::kinematic,
                      .pose = {Vec3(-0.25, 0.1, 0)},
                      .track = {.keys = {{0, {Vec3(-0.25, 0.1, 0)}}, {4, {Vec3(0.55, 0.1, 0)}}},
                                .interpolation = Interpolation::linear}});
  std::vector<BodyHandle> stack;
  for (int i = 0; i < 3; ++i)
    stack.push_back(world.add_body({.shape = Box{Vec3::Constant(0.2)}, .pose = {Vec3(0, 0.1 + 0.2 * i, 0)}}));
  const Tally r = run(world, 3.5);
  EXPECT_LT(r.penetration, 1e-3);
  const Real face = world.body(pusher).pose.position.x() + 0.1;
  for (int i = 0; i < 3; ++i) {
    const BodyState s = world.body(stack[static_cast<std::size_t>(i)]);
    EXPECT_NEAR(s.velocity.x(), 0.2, 2e-3) << i;
    EXPECT_NEAR(s.centre.y(), 0.1 + 0.2 * i, 1e-3) << i;
    EXPECT_NEAR(s.centre.x(), face + 0.1, 0.03) << i;
  }
  // The pusher's force equals the floor friction of all three boxes.
  Vec3 push = Vec3::Zero();
  for (const ContactState& c : world.contacts())
    if (c.a == pusher || c.b == pusher) push += c.a == pusher ? -c.force : c.force;
  const Real weight = 3 * world.body(stack[0]).mass * kImpactGravity;
  EXPECT_NEAR(push.x() / (0.5 * (weight - push.y())), 1, 0.01);
}
OFFSTAGE_BOTH_SOLVERS(Solvers, Paddle);

// Boxes that rotate and slide fast touch with corners that were not near at the start of the step.
TEST(FastSolver, BoxesThatRotateIntoContactDoNotOverlap) {
  const Scatter random{11};
  Real deepest = 0;
  for (uint64_t i = 0; i < 400; ++i) {
    const auto u = [&](uint64_t k) { return 2 * random.uniform(i, k) - 1; };
    const auto direction = [&](uint64_t k) { return Vec3(u(k), u(k + 1), u(k + 2)).normalized(); };
    const auto turn = [&](uint64_t k) { return Quat(u(k), u(k + 1), u(k + 2), u(k + 3)).normalized(); };
    World world({.gravity = Vec3::Zero(), .solver = SolverKind::fast});
    const Vec3 from = direction(0);
    for (const Real side : {-1.0, 1.0}) {
      const uint64_t k = side < 0 ? 10 : 30;
      world.add_body({.shape = Box{Vec3(1, 0.6, 0.8)},
                      .pose = {side * 0.9 * from, turn(k)},
                      .velocity = side * (-2.5 * from + 1.5 * direction(k + 4)),
                      .angular_velocity = 9 * direction(k + 7),
                      .restitution = 0});
    }
    for (int step = 0; step < 120; ++step)
      deepest = std::max(deepest, world.step(1.0 / 240).contacts.penetration);
  }
  EXPECT_LT(deepest, 1e-3);
}

// Without restitution, contacts close within a step. Their impulses act on both bodies at the place where the
// surfaces touch then; with the arms of the middle of the step, 0.8 % of the angular momentum would change.
TEST(FastSolver, AnImpactWithinAStepKeepsTheAngularMomentum) {
  struct Case {
    Shape a, b;
    Real bound;
  };
  constexpr Real kStep = 1.0 / 60, kPlaces = 24;
  for (const Case& c : {Case{Box{{0.3, 0.2, 0.25}}, Box{{0.2, 0.2, 0.2}}, 2e-3},
                        {Capsule{0.08, 0.3}, Box{{0.3, 0.3, 0.2}}, 5e-4}})
    for (int i = 0; i < kPlaces; ++i) {
      World world({.gravity = Vec3::Zero(), .max_step = kStep, .solver = SolverKind::fast, .sleep = false});
      const Vec3 place(0.3 + i * 2 * kStep / kPlaces, 0.05, 0.02);
      const BodyHandle bodies[] = {
          world.add_body({.shape = c.a,
                          .pose = {place, Quat(0.9, 0.2, 0.3, 0.1).normalized()},
                          .velocity = {-2, 1, 0.4},
                          .angular_velocity = {1, 2, -3},
                          .restitution = 0}),
          world.add_body({.shape = c.b,
                          .pose = {Vec3(-0.1, 0, 0), Quat(0.8, -0.3, 0.1, 0.4).normalized()},
                          .velocity = {0.3, -0.5, 0},
                          .angular_velocity = {-2, 1, 1},
                          .restitution = 0})};
      Real size = 0;
      const auto momentum = [&] {
        Vec3 sum = Vec3::Zero();
        size = 0;
        for (const BodyHandle handle : bodies) {
          const BodyState s = world.body(handle);
          sum += s.centre.cross(s.mass * s.velocity) + s.angular_momentum;
          size += s.mass * s.centre.norm() * s.velocity.norm() + s.angular_momentum.norm();
        }
        return sum;
      };
      const Vec3 start = momentum(), velocity = world.body(bodies[1]).velocity;
      for (int k = 0; k < 20 && world.body(bodies[1]).velocity == velocity; ++k) world.step(kStep);
      ASSERT_NE(world.body(bodies[1]).velocity, velocity) << i;
      EXPECT_LT((momentum() - start).norm(), c.bound * size) << i;
    }
}

class Clatter : public BothSolvers {};

// A nearly flat body touches the floor with one side after the other, several times in a sub-step.
TEST_P(Clatter, OfAnElasticBodyKeepsItsEnergy) {
  const struct {
    const char* name;
    Shape shape;
    Real tilt;  // [deg]
  } cases[] = {{"plate", Box{{0.6, 0.1, 0.4}}, 1},
               {"plate", Box{{0.6, 0.1, 0.4}}, 3},
               {"plate", Box{{0.6, 0.1, 0.4}}, 7},
               {"cube", Box{{0.3, 0.3, 0.3}}, 1},
               {"cube", Box{{0.3, 0.3, 0.3}}, 3}};
  for (const Real step : {1.0 / 240, 1.0 / 60})
    for (const auto& c : cases) {
      World world(weightless(step));
      world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 1, .friction = 0});
      const BodyHandle body = world.add_body(
          {.shape = c.shape,
           .pose = {Vec3(0, 0.8, 0), Quat(Eigen::AngleAxisd(c.tilt * std::numbers::pi / 180, Vec3::UnitZ()))},
           .velocity = {0, -5, 0},
           .mass = 1,
           .restitution = 1,
           .friction = 0});
      const Real before = world.energy().kinetic;
      run(world, 0.4, step);
      EXPECT_NEAR(world.energy().kinetic / before, 1, 1e-3)
          << c.name << ' ' << c.tilt << " degrees, " << step;
      EXPECT_GT(world.body(body).velocity.y(), 0);
    }
}

OFFSTAGE_ALL_SOLVERS(Solvers, Clatter);

// The free end of a rod does not touch the floor, so only the impact at the other end determines the impulse.
TEST(AutomaticSolver, ResolvesAnInelasticImpactOfARodAtItsTime) {
  for (const Real step : {1.0 / 240, 1.0 / 60}) {
    World world({.gravity = Vec3::Zero(), .max_step = step, .sleep = false});
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0, .friction = 0});
    const Real tilt = std::numbers::pi / 4;
    const Capsule rod{0.02, 1};
    const BodyHandle body =
        world.add_body({.shape = rod,
                        .pose = {Vec3(0, 1, 0), Quat(Eigen::AngleAxisd(tilt, Vec3::UnitZ()))},
                        .velocity = {0, -5, 0},
                        .mass = 1,
                        .restitution = 0,
                        .friction = 0});
    const MassProperties unit = mass_properties(Shape{rod});
    const Real arm = rod.height / 2 * std::sin(tilt),
               mobility = 1 + arm * arm * unit.volume / unit.inertia(2, 2);
    run(world, 0.15, step);
    EXPECT_NEAR(world.body(body).velocity.y(), -5 + 5 / mobility, 1e-3);
  }
}

}  // namespace
}  // namespace offstage::sim
