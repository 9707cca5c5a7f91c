#include "sim/collision/box_box.h"

#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include "sim/collision/gjk.h"
#include "tests/convex_samples.h"

namespace offstage::sim {
namespace {

std::set<uint32_t> point_ids(const Manifold& m) {
  std::set<uint32_t> result;
  for (uint32_t k = 0; k < m.count; ++k) result.insert(m.points[k].id);
  return result;
}

Real deepest_point(const Manifold& m) {
  Real least = std::numeric_limits<Real>::infinity();
  for (uint32_t k = 0; k < m.count; ++k) least = std::min(least, m.points[k].separation);
  return least;
}

struct PlacedBoxes {
  Convex a, b;
  Pose a_from_b;
  Real size, margin;
};

/// Returns a random rotation, quarter turns, a turn about an axis of A, or a tiny perturbation of one of
/// these.
Quat turn(Dice& dice) {
  Quat q = dice.chance(0.3) ? dice.rotation() : Quat::Identity();
  if (dice.chance(0.5))
    q = q * Quat(Eigen::AngleAxisd(std::numbers::pi / 2 * dice.index(4), Vec3::Unit(dice.index(3))));
  if (dice.chance(0.4)) q = q * Quat(Eigen::AngleAxisd(dice.uniform(0, 7), Vec3::Unit(dice.index(3))));
  if (dice.chance(0.5))
    q = q * Quat(Eigen::AngleAxisd(std::pow(10, dice.uniform(-14, -2)), dice.direction()));
  return q;
}

PlacedBoxes random_box_pair(Dice& dice) {
  const Real size = std::pow(10, dice.uniform(-3, 2)), other = size * std::pow(10, dice.uniform(-2, 0));
  const auto sizes = [&](Real s) { return Vec3(s * (Vec3::Constant(1.1) + dice.in_cube())); };
  PlacedBoxes pair{convex(Box{sizes(size)}), convex(Box{sizes(other)}), {}, size, 0.01 * other};
  pair.a_from_b = {2 * size * dice.direction(), turn(dice)};
  if (dice.chance(0.5)) pair.a_from_b.position[dice.index(3)] = 0;
  constexpr std::array kGaps = {2.0,  0.9,    0.1,   1e-3,  1e-6, 1e-9, 1e-13, 0.0,
                                -0.0, -1e-13, -1e-9, -1e-6, -0.1, -1.0, -10.0};
  GjkCache fresh;
  const Separation s = gjk(pair.a, pair.b, pair.a_from_b, fresh);
  pair.a_from_b.position += (s.distance - pair.margin * kGaps[dice.index(kGaps.size())]) * s.normal;
  return pair;
}

TEST(BoxBox, AgreesWithTheDistanceAndTheManifoldOfConvexSolids) {
  Dice dice(1);
  int answered = 0, unanswered_overlaps = 0, touching = 0, same = 0, same_points = 0;
  constexpr int kPairs = 20000;
  for (int k = 0; k < kPairs; ++k) {
    const PlacedBoxes p = random_box_pair(dice);
    GjkCache fresh;
    const Separation s = gjk(p.a, p.b, p.a_from_b, fresh);
    const Manifold expected = manifold(p.a, p.b, p.a_from_b, s, p.margin);
    Manifold m;
    SCOPED_TRACE(k);
    const Real rounding = 1e-9 * p.size;
    if (!box_manifold(p.a, p.b, p.a_from_b, p.margin, m)) {
      unanswered_overlaps += s.distance < -rounding;
      continue;
    }
    ++answered;
    if (std::abs(s.distance - p.margin) > rounding) {
      ASSERT_EQ(m.count > 0, s.distance < p.margin);
    }
    if (m.count == 0 || expected.count == 0) continue;
    ++touching;
    ASSERT_NEAR(m.normal.norm(), 1, 1e-12);
    ASSERT_NEAR(deepest_point(m), deepest_point(expected), 0.06 * p.margin + rounding);
    ASSERT_NEAR(deepest_point(m), s.distance, 0.06 * p.margin + rounding);
    ASSERT_EQ(point_ids(m).size(), m.count);
    for (uint32_t i = 0; i < m.count; ++i) {
      const ContactPoint& c = m.points[i];
      ASSERT_LE(c.separation, p.margin + rounding);
      ASSERT_LT((c.on_a - c.on_b - c.separation * m.normal).norm(), 1e-12 * p.size);
      const Vec3 out_a = c.on_a.cwiseAbs() - p.a.half,
                 out_b = p.a_from_b.point_to_body(c.on_b).cwiseAbs() - p.b.half;
      ASSERT_NEAR(out_a.maxCoeff(), 0, 0.06 * p.margin + rounding) << "on A";
      ASSERT_NEAR(out_b.maxCoeff(), 0, 0.06 * p.margin + rounding) << "on B";
    }
    if ((m.normal - expected.normal).norm() > 1e-5) {
      ASSERT_LT(std::abs(s.distance), 1.01e-3 * p.margin)
          << "the normal is ambiguous only if the boxes touch";
      continue;
    }
    ++same;
    ASSERT_NEAR(deepest_point(m), deepest_point(expected), 2e-3 * p.margin + rounding);
    same_points += m.source == expected.source && point_ids(m) == point_ids(expected);
  }
  EXPECT_GT(answered, 0.75 * kPairs);
  EXPECT_LT(unanswered_overlaps, 0.002 * kPairs);
  EXPECT_GT(same, 0.85 * touching);
  EXPECT_GT(same_points, 0.99 * same);
}

const Convex& unit_cube() {
  static const Convex box = convex(Box{Vec3::Ones()});
  return box;
}

TEST(BoxBox, EqualCubesExactlyOnAndBesideEachOtherTouchWithTheirFourCorners) {
  for (const Real size : {1e-3, 1.0, 100.0}) {
    const Convex box = convex(Box{Vec3::Constant(size)});
    for (int axis = 0; axis < 3; ++axis)
      for (const Real side : {-1.0, 1.0}) {
        Manifold m;
        ASSERT_TRUE(
            box_manifold(box, box, {side * size * Vec3::Unit(axis), Quat::Identity()}, 0.01 * size, m));
        ASSERT_EQ(m.count, 4u);
        EXPECT_EQ(m.source, NormalSource::face_of_a);
        EXPECT_EQ(m.normal, -side * Vec3::Unit(axis));
        for (const ContactPoint& c : m.points) {
          EXPECT_EQ(c.separation, 0);
          EXPECT_LT((c.on_a.cwiseAbs() - box.half).norm(), 1e-15 * size) << "a corner";
        }
      }
  }
}

// Bricks that overhang by half and share no corner, then a brick beside another that touches it only along an
// edge.
TEST(BoxBox, BricksRestOnTheHalfThatTheyShare) {
  const Convex brick = convex(Box{{0.4, 0.1, 0.2}});
  Manifold m;
  ASSERT_TRUE(box_manifold(brick, brick, {Vec3(0.2, -0.1, 0), Quat::Identity()}, 1e-3, m));
  ASSERT_EQ(m.count, 4u);
  for (const ContactPoint& c : m.points) {
    EXPECT_NEAR(c.separation, 0, 1e-16);
    EXPECT_NEAR(std::abs(c.on_a.x() - 0.1), 0.1, 1.01e-6) << "within a thousandth of the margin";
    EXPECT_NEAR(std::abs(c.on_a.z()), 0.1, 1e-15);
  }
  if (box_manifold(brick, brick, {Vec3(0.41, -0.11, 0), Quat::Identity()}, 0.02, m)) {
    ADD_FAILURE() << "edges beside each other are closest";
  }
}

// The configurations of a stack at rest: small gaps and overlaps, tilted and moved by tiny amounts. The
// fallback to GJK costs three times as much, so it must be rare.
TEST(BoxBox, AStackAtRestKeepsItsPointsAndSeldomNeedsGjk) {
  Dice dice(5);
  constexpr Real kMargin = 0.01;
  Manifold first;
  ASSERT_TRUE(box_manifold(unit_cube(), unit_cube(), {Vec3(0, -1, 0), Quat::Identity()}, kMargin, first));
  int unanswered = 0;
  constexpr int kPoses = 3000;
  for (int k = 0; k < kPoses; ++k) {
    const Real tilt = std::pow(10, dice.uniform(-15, -5.5)),
               gap = std::pow(10, dice.uniform(-12, -4)) * (dice.chance(0.5) ? 1 : -1);
    const Pose pose{Vec3(0, -1 - gap, 0) + 3e-6 * dice.uniform() * dice.in_cube(),
                    Quat(Eigen::AngleAxisd(tilt, dice.direction()))};
    Manifold m;
    if (!box_manifold(unit_cube(), unit_cube(), pose, kMargin, m)) {
      ++unanswered;
      continue;
    }
    ASSERT_EQ(point_ids(m), point_ids(first)) << "tilt " << tilt << " gap " << gap;
    ASSERT_GT(std::abs(m.normal.y()), 1 - 1e-9);
  }
  EXPECT_LT(unanswered, 0.05 * kPoses);
}

TEST(BoxBox, TwistedBoxesKeepTheFacesNormalWhileTheyRock) {
  const Quat twist(Eigen::AngleAxisd(0.7, Vec3::UnitY()));
  Dice dice(19);
  int unanswered = 0;
  constexpr int kPoses = 1000;
  for (int k = 0; k < kPoses; ++k) {
    const Quat rock(Eigen::AngleAxisd(dice.uniform(0, 3e-4), dice.direction()));
    Manifold m;
    if (!box_manifold(unit_cube(), unit_cube(), {{0, -1 + dice.uniform(-4e-4, 5e-4), 0}, rock * twist}, 0.01,
                      m)) {
      ++unanswered;
      continue;
    }
    ASSERT_TRUE(m.source == NormalSource::face_of_a || m.source == NormalSource::face_of_b);
    ASSERT_EQ(m.count, 4u);
    ASSERT_GT(std::abs(m.normal.y()), 0.9999);
  }
  EXPECT_LT(unanswered, 0.05 * kPoses);
}

TEST(BoxBox, EdgesThatCrossMeetInOnePoint) {
  const Quat on_edge(Eigen::AngleAxisd(std::numbers::pi / 4, Vec3::UnitX())),
      across(Eigen::AngleAxisd(std::numbers::pi / 4, Vec3::UnitZ()));
  for (const Real gap : {0.005, 0.0, -0.005}) {
    const Pose a{Vec3::Zero(), on_edge}, b{{0.1, -std::sqrt(2) - gap, 0.2}, across};
    const Pose a_from_b{a.point_to_body(b.position), a.orientation.conjugate() * b.orientation};
    Manifold m;
    ASSERT_TRUE(box_manifold(unit_cube(), unit_cube(), a_from_b, 0.01, m));
    ASSERT_EQ(m.count, 1u);
    EXPECT_EQ(m.source, NormalSource::edges);
    EXPECT_NEAR(m.points[0].separation, gap, 1e-14);
    EXPECT_LT((a.vector_to_world(m.normal) - Vec3::UnitY()).norm(), 1e-14);
    EXPECT_LT((a.point_to_world(m.points[0].on_a) - Vec3(0.1, -std::sqrt(0.5), 0)).norm(), 1e-13);
  }
}

}  // namespace
}  // namespace offstage::sim
