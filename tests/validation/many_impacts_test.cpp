/// Many impacts at once or in sequence within a sub-step: columns of balls that rebound into each other, the
/// break of a rack, thousands of bounces; and bodies whose contacts have no solution.

#include <array>
#include <cmath>
#include <vector>

#include "tests/validation/both_solvers.h"

namespace offstage::sim {
namespace {

constexpr std::array kAllSolvers = {SolverKind::exact, SolverKind::fast, SolverKind::automatic};
constexpr std::array kBothSteps = {1.0 / 240, 1.0 / 60};

std::string named(SolverKind solver, Real step) {
  return name_of(solver) + " at 1/" + std::to_string(std::lround(1 / step)) + " s";
}

/// A column of balls of 1 m diameter above a floor.
struct BallColumn {
  World world;
  std::vector<BodyHandle> balls;

  BallColumn(SolverKind solver, Real step, int count, Real e, Real gap, Real drop)
      : world({.max_step = step, .solver = solver, .sleep = false}) {
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = e, .friction = 0});
    for (int i = 0; i < count; ++i)
      balls.push_back(world.add_body({.shape = Sphere{0.5},
                                      .pose = {Vec3(0, 0.5 + drop + (1 + gap) * i, 0)},
                                      .mass = 10,
                                      .restitution = e,
                                      .friction = 0}));
  }
  Real overlap() const {
    Real deepest = 0.5 - world.body(balls.front()).centre.y();
    for (std::size_t i = 1; i < balls.size(); ++i)
      deepest =
          std::max(deepest, 1 - (world.body(balls[i]).centre.y() - world.body(balls[i - 1]).centre.y()));
    return deepest;
  }
};

// The lowest ball rebounds at 5 to 10 m/s into one that still falls, within the same sub-step.
TEST(ManyImpacts, BallsOfAColumnThatReboundIntoEachOtherDoNotOverlap) {
  for (const SolverKind solver : kAllSolvers)
    for (const Real step : kBothSteps)
      for (const int count : {2, 3, 10})
        for (const Real e : {0.5, 1.0})
          for (const Real gap : {0.0, 0.005, 0.02}) {
            BallColumn column(solver, step, count, e, gap, 5);
            const Real energy = column.world.energy().total();
            Real deepest = 0, greatest = 0;
            while (column.world.time() < 2) {
              column.world.step(step);
              deepest = std::max(deepest, column.overlap());
              greatest = std::max(greatest, column.world.energy().total());
            }
            EXPECT_LT(deepest, 1e-4) << named(solver, step) << ", " << count << " balls, e " << e << ", gap "
                                     << gap;
            EXPECT_LT(greatest, energy * (1 + 1e-9)) << named(solver, step);
          }
}

// This column has more impacts than are traced back in a sub-step. The other impacts are plastic, and pushed
// balls hit balls that were far away at the start of the sub-step.
TEST(ManyImpacts, BallsOfALongColumnDoNotPassThroughEachOther) {
  BallColumn column(SolverKind::fast, 1.0 / 60, 60, 0.5, 0.02, 5);
  Real deepest = 0;
  while (column.world.time() < 1.5) {
    column.world.step(1.0 / 60);
    deepest = std::max(deepest, column.overlap());
  }
  EXPECT_LT(deepest, 0.01);
}

// A ball rebounds from the floor into another falling ball, and both stop. Their impact is plastic, so it is
// not traced back: the motion of both balls after the first impact must be computed again.
TEST(ManyImpacts, ABallThatReboundsIntoAnotherStopsWithIt) {
  for (const SolverKind solver : {SolverKind::fast, SolverKind::automatic})
    for (const Real gap : {0.001, 0.01, 0.05}) {
      constexpr Real kStep = 1.0 / 60, kSpeed = 10;
      World world({.gravity = Vec3::Zero(), .max_step = kStep, .solver = solver, .sleep = false});
      world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 1, .friction = 0});
      const auto ball = [&](Real height) {
        return world.add_body({.shape = Sphere{0.5},
                               .pose = {Vec3(0, height, 0)},
                               .velocity = Vec3(0, -kSpeed, 0),
                               .restitution = 0,
                               .friction = 0});
      };
      const BodyHandle low = ball(0.52), high = ball(1.52 + gap);
      world.step(kStep);
      const BodyState a = world.body(low), b = world.body(high);
      // The balls meet in the middle of the gap, because both move at the same speed after the rebound.
      const Real met = 0.5 + gap / 2;
      EXPECT_NEAR(a.velocity.y() + b.velocity.y(), 0, 1e-9) << named(solver, kStep) << ", gap " << gap;
      EXPECT_NEAR(a.centre.y(), met, 1e-4) << named(solver, kStep) << ", gap " << gap;
      EXPECT_NEAR(b.centre.y() - a.centre.y(), 1, 1e-4) << named(solver, kStep) << ", gap " << gap;
    }
}

// The report contains overlaps of the whole step, also those that have disappeared at its end.
TEST(ManyImpacts, ThePenetrationOfAStepIsTheGreatestInIt) {
  World world({.gravity = Vec3::Zero(), .sleep = false});
  world.add_body({.shape = Sphere{0.5}, .pose = {Vec3(0, 0, 0)}, .restitution = 1});
  world.add_body(
      {.shape = Sphere{0.5}, .pose = {Vec3(0, 0.95, 0)}, .velocity = {0, -20, 0}, .restitution = 1});
  EXPECT_GE(world.step(1.0 / 240).contacts.penetration, 0.05 - 1e-12) << "although the balls are apart again";
}

/// A rack of fifteen touching balls in a triangle, and a cue ball that approaches along its axis. The mirror
/// image of ball i is ball mirror(i).
struct Rack {
  World world;
  std::array<BodyHandle, 15> balls;
  BodyHandle cue;

  Rack(SolverKind solver, Real step, ImpactLaw law, bool reversed)
      : world({.gravity = Vec3::Zero(), .max_step = step, .solver = solver, .impact = law, .sleep = false}) {
    constexpr Real kRadius = 0.02858, kApart = kRadius * (1 + 1e-7);
    const auto ball = [&](const Vec3& at, Real speed) {
      return world.add_body({.shape = Sphere{kRadius},
                             .pose = {at},
                             .velocity = {speed, 0, 0},
                             .mass = 0.17,
                             .restitution = 0.95,
                             .friction = 0});
    };
    for (std::size_t i = 0; i < 15; ++i) {
      const std::size_t k = reversed ? 14 - i : i, row = row_of(k);
      balls[k] =
          ball({Real(row) * std::sqrt(3) * kApart, 0, (2 * Real(k - first_of(row)) - Real(row)) * kApart}, 0);
    }
    cue = ball({-0.5, 0, 0}, 8);
  }
  static std::size_t first_of(std::size_t row) { return row * (row + 1) / 2; }
  static std::size_t row_of(std::size_t i) {
    std::size_t row = 0;
    while (first_of(row + 1) <= i) ++row;
    return row;
  }
  static std::size_t mirror(std::size_t i) { return 2 * first_of(row_of(i)) + row_of(i) - i; }
};

// Solution of the complementarity problem of all 31 contacts (P >= 0, u+ >= -e u-): the velocity of the cue
// ball changes from 8 to -5.817 m/s, the corner balls leave at 1.544 m/s, and 0.9136 of the energy remains.
TEST(ManyImpacts, ARackBreaksTheSameWithAllSolvers) {
  for (const SolverKind solver : kAllSolvers)
    for (const Real step : kBothSteps) {
      Rack rack(solver, step, ImpactLaw::simultaneous, false);
      const Real energy = rack.world.energy().total();
      run(rack.world, 0.08, step);
      EXPECT_NEAR(rack.world.body(rack.balls[14]).velocity.norm(), 1.544, 1e-3) << named(solver, step);
      EXPECT_NEAR(rack.world.body(rack.cue).velocity.x(), -5.8171, 1e-3) << named(solver, step);
      EXPECT_NEAR(rack.world.energy().total() / energy, 0.9136, 1e-4) << named(solver, step);
    }
}

TEST(ManyImpacts, MirrorImagesOfARackStayMirrorImages) {
  for (const ImpactLaw law : {ImpactLaw::sequential, ImpactLaw::simultaneous})
    for (const SolverKind solver : kAllSolvers)
      for (const Real step : kBothSteps) {
        Rack rack(solver, step, law, false), reversed(solver, step, law, true);
        run(rack.world, 0.4, step);
        run(reversed.world, 0.4, step);
        for (std::size_t i = 0; i < 15; ++i) {
          const Vec3 at = rack.world.body(rack.balls[i]).centre,
                     there = rack.world.body(rack.balls[Rack::mirror(i)]).centre;
          EXPECT_LT((at - Vec3(there.x(), there.y(), -there.z())).norm(), 1e-9)
              << named(solver, step) << ' ' << i;
          EXPECT_LT((at - reversed.world.body(reversed.balls[i]).centre).norm(), 1e-9)
              << named(solver, step) << " in the reverse order of the list " << i;
        }
      }
}

// A bounce is early by at most the tolerance of the time of impact, which also shifts the next one.
TEST(ManyImpacts, TenThousandElasticBouncesBetweenWallsAreCounted) {
  constexpr Real kRadius = 0.005, kRoom = 0.01, kSpeed = 2;
  for (const SolverKind solver : kAllSolvers)
    for (const Real step : kBothSteps) {
      World world({.gravity = Vec3::Zero(), .max_step = step, .solver = solver, .sleep = false});
      for (const Real side : {-1.0, 1.0})
        world.add_body({.shape = Box{{1, 1, 1}},
                        .motion = MotionType::static_body,
                        .pose = {Vec3(side * (0.5 + kRadius + kRoom / 2), 0, 0)},
                        .restitution = 1,
                        .friction = 0});
      const auto ball = world.add_body(
          {.shape = Sphere{kRadius}, .velocity = {kSpeed, 0, 0}, .restitution = 1, .friction = 0});
      const Tally all = run(world, 10'000 * kRoom / kSpeed, 1.0 / 60);
      EXPECT_NEAR(static_cast<Real>(all.collisions), 10'000, 1) << named(solver, step);
      EXPECT_NEAR(std::abs(world.body(ball).velocity.x()), kSpeed, 1e-9) << named(solver, step);
    }
}

// A ball hits the tip of a triangle of 21 touching balls along its axis. The cluster has 46 contacts. All
// solvers give the same solution, which is symmetric.
TEST(ManyImpacts, OfARackKeepItsSymmetry) {
  constexpr Real kRadius = 0.02858, kPitch = 2 * kRadius * (1 + 1e-7);
  constexpr int kRows = 6;
  for (const SolverKind solver : kAllSolvers)
    for (const Real step : kBothSteps) {
      World world({.gravity = Vec3::Zero(), .max_step = step, .solver = solver, .sleep = false});
      std::vector<std::vector<BodyHandle>> rows(kRows);
      const auto ball = [&](Real x, Real z, Real speed) {
        return world.add_body({.shape = Sphere{kRadius},
                               .pose = {Vec3(x, 0, z)},
                               .velocity = {speed, 0, 0},
                               .mass = 0.17,
                               .restitution = 0.95,
                               .friction = 0});
      };
      for (int i = 0; i < kRows; ++i)
        for (int k = 0; k <= i; ++k)
          rows[i].push_back(ball(i * kPitch * std::sqrt(3) / 2, (k - 0.5 * i) * kPitch, 0));
      ball(-0.5, 0, 8);
      run(world, 0.5, step);
      for (int i = 0; i < kRows; ++i)
        for (int k = 0; k <= i; ++k) {
          const Vec3 at = world.body(rows[i][k]).centre, mirrored = world.body(rows[i][i - k]).centre;
          EXPECT_LT((at - Vec3(mirrored.x(), mirrored.y(), -mirrored.z())).norm(), 1e-6)
              << named(solver, step) << ", ball " << k << " of row " << i;
        }
      EXPECT_NEAR(world.body(rows[kRows - 1][0]).velocity.x(), 1.103, 1e-3) << named(solver, step);
    }
}

// A bar between jaws that are closer than it is thick: both push it out, so the contact problem has no
// solution. The bar may stay or be squeezed out slowly, but must not be ejected.
TEST(ManyImpacts, ContactsThatContradictEachOtherAddNoEnergyAndAreReported) {
  for (const SolverKind solver : kAllSolvers)
    for (const Real step : kBothSteps) {
      World world({.max_step = step, .solver = solver, .sleep = false});
      world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
      for (const Real side : {-1.0, 1.0})
        world.add_body(
            {.shape = Box{{0.5, 1, 1}},
             .motion = MotionType::static_body,
             .pose = {Vec3(side * 0.259, 0.5, 0), Quat(Eigen::AngleAxisd(side * 0.01, Vec3::UnitZ()))}});
      const auto bar = world.add_body(
          {.name = "bar",
           .shape = Box{{0.02, 0.6, 0.02}},
           .pose = {Vec3(0, 0.5, 0), Quat(Eigen::AngleAxisd(0.01, Vec3(1, 1, 1).normalized()))}});
      // Penetration correction moves bodies at up to half a metre per second.
      const Real most = world.energy().total() + world.body(bar).mass * (0.125 + 9.81 * 0.005);
      std::size_t rough = 0;
      for (int i = 0; i < 240; ++i) {
        for (const RoughContact& contact : world.step(1.0 / 240).rough_contacts) {
          EXPECT_TRUE(contact.a == bar || contact.b == bar);
          ++rough;
        }
        EXPECT_LT(world.energy().total(), most) << named(solver, step) << " at " << world.time();
      }
      if (solver == SolverKind::exact) {
        EXPECT_GT(rough, 0u);
      }
    }
}

}  // namespace
}  // namespace offstage::sim
