#include "sim/contact/relaxation.h"

#include <cmath>
#include <set>
#include <vector>

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "tests/box_scene.h"
#include "tests/convex_samples.h"

namespace offstage::sim {
namespace {

constexpr Real kStep = 1.0 / 240;

Real greatest_move(const BoxScene& now, const BoxScene& before) {
  Real most = 0;
  for (std::size_t i = 0; i < now.bodies.size(); ++i)
    most = std::max(most, (now.bodies[i].pose.position - before.bodies[i].pose.position).norm());
  return most;
}

/// Returns boxes that overlap or approach each other, without a static body.
BoxScene floating_boxes(uint64_t seed) {
  BoxScene s;
  Dice dice(seed);
  s.gravity = Vec3::Zero();
  for (int i = 0; i < 40; ++i) {
    const Vec3 size = Vec3::Constant(0.8) + 0.4 * dice.in_cube();
    s.add(size, dice.uniform(0.1, 10), 1.6 * dice.in_cube(), dice.rotation());
    s.bodies.back().velocity = -s.bodies.back().pose.position + dice.in_cube();
    s.bodies.back().angular_velocity = 3 * dice.in_cube();
  }
  return s;
}

TEST(Relaxation, StackOfTenStays) {
  BoxScene s = box_stack(10);
  const BoxScene start = s;
  s.run(4, kStep);
  EXPECT_LT(greatest_move(s, start), 3e-4);
  EXPECT_LT(s.kinetic_energy(), 1e-9);
}

TEST(Relaxation, BoxDoesNotCreepBelowTheFrictionAngle) {
  BoxScene s = box_on_incline(26);  // tan 26 = 0.488, friction 0.5
  const BoxScene start = s;
  s.run(2, kStep);
  EXPECT_LT(greatest_move(s, start), 1e-6);
}

TEST(Relaxation, BoxSlidesDownAboveTheFrictionAngle) {
  BoxScene s = box_on_incline(40);
  const BoxScene start = s;
  s.run(2, kStep);
  const Real angle = 40 * std::numbers::pi / 180;
  const Real expected = 9.81 * (std::sin(angle) - 0.5 * std::cos(angle)) * 4 / 2;
  EXPECT_NEAR(greatest_move(s, start), expected, 1e-3);
}

// The stopping distance is v^2 / (2 mu g), for any direction and also with coarse steps.
TEST(Relaxation, SlidingBoxStopsWhereFrictionSays) {
  const Real expected = 25 / (2 * 0.5 * 9.81);
  for (const Real h : {kStep, 4 * kStep})
    for (const Real heading : {0.0, 30.0, 45.0}) {
      BoxScene s = sliding_box(heading);
      const Vec3 start = s.bodies.back().pose.position, v = s.bodies.back().velocity / 5;
      s.run(2, h);
      const Vec3 way = s.bodies.back().pose.position - start;
      EXPECT_NEAR(way.dot(v), expected, 1e-3) << heading;
      EXPECT_LT((way - way.dot(v) * v).norm(), 1e-3) << heading;
      EXPECT_LT(s.kinetic_energy(), 1e-12);
    }
}

TEST(Relaxation, WallOfHundredStandsAtCoarseSteps) {
  BoxScene s = brick_wall(100);
  const BoxScene start = s;
  s.run(4, 1.0 / 60);
  EXPECT_LT(greatest_move(s, start), 2e-3);
  EXPECT_LT(s.deepest(), 1e-3);
}

// Without the averaging of forces over steps, the wall keeps swaying with 0.02 J.
TEST(Relaxation, WallOfHundredReachesRest) {
  BoxScene s = brick_wall(100);
  s.run(2, kStep);
  EXPECT_LT(s.kinetic_energy(), 1e-5);
}

TEST(LongRelaxation, WallOfThousandStandsAtCoarseSteps) {
  BoxScene s = brick_wall(1000);
  const BoxScene start = s;
  s.run(4, 1.0 / 60);
  EXPECT_LT(greatest_move(s, start), 0.02);
  EXPECT_LT(s.deepest(), 1e-3);
}

TEST(LongRelaxation, PileEndsWithoutOverlapInsideThePit) {
  BoxScene s = box_pile(100);
  s.run(6, kStep);
  EXPECT_LT(s.deepest(), 1e-3);
  EXPECT_LT(s.kinetic_energy(), 0.1);
  for (const BoxBody& b : s.bodies) EXPECT_GT(b.pose.position.y() + (b.mass == 0 ? 2 : 0), 0.4);
}

TEST(Relaxation, FreeBodiesKeepMomentum) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    BoxScene s = floating_boxes(seed);
    s.prepare(kStep);
    ASSERT_GT(s.patches().size(), 10u);
    const std::vector<RelaxedBody> before = s.relaxed();
    s.solve(kStep);
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
    Real size = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      const RelaxedBody &b = before[i], &now = s.relaxed()[i];
      const Vec3 p = (now.velocity - b.velocity) / b.inverse_mass;
      const Vec3 spin = now.angular_velocity - b.angular_velocity - kStep * b.free_angular_acceleration;
      linear += p;
      angular += s.bodies[i].pose.position.cross(p) + b.inverse_inertia.inverse() * spin;
      size += p.norm();
    }
    EXPECT_GT(size, 1);
    EXPECT_LT(linear.norm(), 1e-12 * size);
    EXPECT_LT(angular.norm(), 1e-11 * size);
  }
}

TEST(Relaxation, CollisionsDoNotAddEnergy) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    BoxScene s = floating_boxes(seed);
    const Real start = s.kinetic_energy();
    Real before = start;
    for (int k = 0; k < 60; ++k) {
      s.step(kStep);
      ASSERT_LT(s.kinetic_energy(), before + 1e-3 * start) << "step " << k;
      before = s.kinetic_energy();
    }
    EXPECT_LT(before, 0.9 * start);
  }
}

// Deep overlaps are removed by moving the bodies, which gain no velocity.
TEST(Relaxation, PushingOutLeavesNoVelocity) {
  BoxScene s;
  s.gravity = Vec3::Zero();
  s.add(Vec3::Ones(), 1, Vec3::Zero());
  s.add(Vec3::Ones(), 3, Vec3(0.1, 0.9, 0.2));
  s.run(0.5, kStep);
  EXPECT_LT(s.deepest(), 1e-6);
  EXPECT_LT(s.kinetic_energy(), 1e-12);
  EXPECT_LT((s.bodies[0].pose.position + 3 * (s.bodies[1].pose.position - Vec3(0.1, 0.9, 0.2))).norm(),
            1e-12);
}

// Each box of the column is pushed back by the boxes above and below it, so the overlaps have to be removed
// for the column as a whole.
TEST(Relaxation, ColumnPressedTogetherIsPushedApartTogether) {
  BoxScene s = box_stack(20);
  Real down = 0;
  for (BoxBody& b : s.bodies)
    if (b.mass > 0) b.pose.position.y() -= down += 2e-3;
  ASSERT_GT(s.deepest(), 1.9e-3);
  s.run(0.5, kStep);
  EXPECT_LT(s.deepest(), 7e-4);  // 3 mm if each pair were corrected alone
}

TEST(Relaxation, ForcesAreWeightAndFrictionOfASlidingBox) {
  BoxScene s = sliding_box(20);
  for (int k = 0; k < 240; ++k) {
    s.step(kStep);
    ASSERT_EQ(s.patches().size(), 1u);
    const ContactPatch& p = s.patches()[0];
    Real normal = 0;
    for (uint32_t i = 0; i < p.count; ++i) {
      ASSERT_GE(p.points[i].force, 0);
      normal += p.points[i].force;
    }
    if (k < 24) continue;  // until the normal forces have shifted to the leading points
    const Vec3 tangential = p.force_t * p.frame.t + p.force_k * p.frame.k, v = s.bodies[1].velocity;
    ASSERT_NEAR(normal, 9.81, 1e-5);
    ASSERT_NEAR(tangential.norm(), 0.5 * 9.81, 1e-5);
    ASSERT_LT(tangential.cross(v).norm(), 1e-5 * v.norm());
  }
}

TEST(Relaxation, NormalForcesOnlyPush) {
  BoxScene s = box_pile(60);
  for (int k = 0; k < 240; ++k) {
    s.step(kStep);
    for (const ContactPatch& p : s.patches())
      for (uint32_t i = 0; i < p.count; ++i) ASSERT_GE(p.points[i].force, 0);
  }
}

TEST(Relaxation, SameBitsForAnyNumberOfThreads) {
  const auto end = [](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    BoxScene s = brick_wall(300);
    s.bodies.back().velocity = Vec3(3, -5, 1);
    s.run(0.25, kStep);
    return s;
  };
  const BoxScene one = end(1), two = end(2), four = end(4);
  for (std::size_t i = 0; i < one.bodies.size(); ++i) {
    ASSERT_EQ(one.bodies[i].pose.position, two.bodies[i].pose.position);
    ASSERT_EQ(one.bodies[i].velocity, two.bodies[i].velocity);
    ASSERT_EQ(one.bodies[i].pose.position, four.bodies[i].pose.position);
  }
}

// A belt runs under the box at 1 m/s: the box reaches the belt's speed after v / (mu g) and keeps it.
TEST(Relaxation, ConveyorCarriesTheBox) {
  BoxScene s;
  s.add_ground();
  s.add(Vec3(1, 0.5, 1), 1, Vec3(0, 0.25, 0));
  for (int k = 0; k < 240; ++k) {
    s.prepare(kStep);
    for (ContactPatch& p : s.patches()) {
      const Vec3 belt(1, 0, 0), seen = p.a == 0 ? belt : Vec3(-belt);
      p.offset = {p.frame.n.dot(seen), p.frame.t.dot(seen), p.frame.k.dot(seen)};
    }
    s.solve(kStep);
    s.finish(kStep);
  }
  const Real reached = 1 / (0.5 * 9.81);
  EXPECT_NEAR(s.bodies.back().velocity.x(), 1, 1e-9);
  EXPECT_NEAR(s.bodies.back().pose.position.x(), 1 - reached / 2, 1e-3);
}

// A patch of one point has no torque about its normal. The first patch keeps a torque from an earlier step,
// in which it had more points. This torque must not turn the body, so the second patch gets no impulse.
TEST(Relaxation, APointHasNoTorque) {
  std::vector<RelaxedBody> bodies(2);
  bodies[0].inverse_mass = 1;
  bodies[0].inverse_inertia = 10 * Mat3::Identity();
  std::vector<ContactPatch> patches(2);
  patches[0] = {.a = 0, .b = 1, .frame = contact_frame(Vec3::UnitY()), .arm_a = -Vec3::UnitY(), .count = 1};
  patches[0].torque_n = 50;
  patches[1] = {.a = 0, .b = 1, .frame = contact_frame(Vec3::UnitZ()), .arm_a = Vec3::UnitX(), .count = 1};
  RelaxationSolver().solve(bodies, patches, {.duration = kStep});
  EXPECT_EQ(patches[1].points[0].impulse, 0);
  EXPECT_EQ(bodies[0].velocity, Vec3::Zero());
  EXPECT_EQ(bodies[0].angular_velocity, Vec3::Zero());
}

TEST(Relaxation, DegenerateInputGivesFiniteNumbers) {
  std::vector<RelaxedBody> bodies(3);
  bodies[0].velocity = Vec3(1, 2, 3);  // has no inverse mass, so nothing moves it
  bodies[1].inverse_mass = 1e9;
  bodies[1].inverse_inertia = 1e18 * Mat3::Identity();
  bodies[2].inverse_mass = 1e-9;  // has no inverse inertia, so it does not turn
  std::vector<ContactPatch> patches(4);
  patches[0] = {.a = 1,
                .b = 0,
                .frame = contact_frame(Vec3::UnitY()),
                .friction_t = 0.5,
                .friction_k = 0.2,
                .count = 4};  // all points at one place, with lever arms of zero
  patches[1] = {.a = 1,
                .b = 2,
                .frame = contact_frame(Vec3::UnitX()),
                .arm_a = Vec3::Constant(1e-3),
                .arm_b = Vec3::Constant(100),
                .friction_t = 1e6,
                .friction_k = 1e6,
                .count = 1};
  patches[1].points[0].separation = -10;
  patches[2] = {.a = 2, .b = 1, .frame = contact_frame(Vec3::UnitZ()), .count = 0};
  patches[3] = {.a = 0, .b = 0, .frame = contact_frame(Vec3::UnitZ()), .count = 2};
  RelaxationSolver solver;
  solver.solve(bodies, patches, {});
  for (const RelaxedBody& b : bodies) {
    EXPECT_TRUE(b.velocity.allFinite() && b.angular_velocity.allFinite());
    EXPECT_TRUE(b.displacement.allFinite() && b.rotation_vector.allFinite());
  }
  EXPECT_EQ(bodies[0].velocity, Vec3(1, 2, 3));
  solver.solve({}, {}, {});
}

TEST(ContactColoring, PatchesOfOneColorShareNoMovedBody) {
  Dice dice(3);
  std::vector<ContactColoring::Link> links;
  for (int i = 0; i < 2000; ++i) {
    const uint32_t a = dice.index(300), b = dice.chance(0.2) ? ContactColoring::kNone : 300 + dice.index(300);
    links.push_back({dice.chance(0.1) ? 0 : a, b});  // body 0 has more patches than there are colours
  }
  ContactColoring coloring;
  coloring.assign(600, links);
  std::set<uint32_t> patches;
  const auto check = [&](uint32_t begin, uint32_t end) {
    std::set<uint32_t> bodies;
    for (uint32_t i = begin; i < end; ++i)
      for (const uint32_t patch : coloring.batches()[i]) {
        if (patch == ContactColoring::kNone) continue;
        EXPECT_TRUE(patches.insert(patch).second);
        for (const uint32_t body : {links[patch].a, links[patch].b})
          EXPECT_TRUE(body == ContactColoring::kNone || bodies.insert(body).second);
      }
  };
  const auto begins = coloring.begins();
  for (std::size_t c = 0; c + 1 < begins.size(); ++c) check(begins[c], begins[c + 1]);
  const auto end = static_cast<uint32_t>(coloring.batches().size());
  EXPECT_LT(coloring.serial_begin(), end);
  for (uint32_t i = coloring.serial_begin(); i < end; ++i) check(i, i + 1);
  EXPECT_EQ(patches.size(), links.size());
}

}  // namespace
}  // namespace offstage::sim
