#include "sim/collision/time_of_impact.h"

#include <array>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include "random.h"
#include "sim/collision/gjk.h"
#include "sim/geometry/convex_hull.h"

namespace offstage::sim {
namespace {

constexpr Real kTolerance = 1e-6;

Pose still_pose(const Vec3& position, Real angle = 0, const Vec3& axis = Vec3::UnitZ()) {
  return {position, Quat(Eigen::AngleAxisd(angle, axis.normalized()))};
}

Real distance(const MovingConvex& a, const MovingConvex& b, Real fraction) {
  const Pose p = a.path.at(fraction), q = b.path.at(fraction);
  GjkCache fresh;
  return gjk(a.shape, b.shape, {p.point_to_body(q.position), p.orientation.conjugate() * q.orientation},
             fresh)
      .distance;
}

/// Returns the time of impact by the book's method (4.4). It samples equal intervals and bisects the first
/// one that ends in contact. It agrees with conservative advancement if the intervals are short enough; it
/// can miss thin objects.
std::optional<Real> bisection(const MovingConvex& a, const MovingConvex& b, Real near, int looks) {
  if (distance(a, b, 0) <= near) return 0;
  for (int k = 1; k <= looks; ++k) {
    Real low = static_cast<Real>(k - 1) / looks, high = static_cast<Real>(k) / looks;
    if (distance(a, b, high) > near) continue;
    while (high - low > 1e-12) {
      const Real middle = (low + high) / 2;
      (distance(a, b, middle) > near ? low : high) = middle;
    }
    return high;
  }
  return std::nullopt;
}

TEST(TimeOfImpact, FallingBoxOnABox) {
  const Convex box = convex(Box{Vec3(1, 1, 1)});
  const PosePath falling(still_pose({0, 3, 0}), still_pose({0, 0, 0})), resting(still_pose({0.2, 0, 0}));
  const auto impact = time_of_impact({box, falling}, {box, resting}, kTolerance);
  ASSERT_TRUE(impact);
  EXPECT_NEAR(impact->fraction, 2.0 / 3, kTolerance);
  EXPECT_LE(impact->fraction, 2.0 / 3);
  EXPECT_NEAR(impact->separation.normal.y(), 1, 1e-9);
  EXPECT_LE(impact->advances, 3);
}

TEST(TimeOfImpact, SpheresThatGlanceAndThatMiss) {
  const Convex ball = convex(Sphere{0.5});
  const PosePath resting(still_pose(Vec3::Zero()));
  for (const Real offset : {0.0, 0.5, 0.9, 0.999, 1.001, 1.5}) {
    const PosePath flying(still_pose({-4, offset, 0}), still_pose({4, offset, 0}));
    const auto impact = time_of_impact({ball, flying}, {ball, resting}, kTolerance);
    ASSERT_EQ(impact.has_value(), offset < 1) << offset;
    if (!impact) continue;
    const Real reach = 1 + kTolerance, expected = (4 - std::sqrt(reach * reach - offset * offset)) / 8;
    EXPECT_NEAR(impact->fraction, expected, 1e-5);
    EXPECT_GE(impact->fraction, expected - 1e-14);
  }
}

TEST(TimeOfImpact, TurningRodMeetsThePlane) {
  // A rod of half length 1 turns about its middle, 0.5 above the plane: its end touches at 30 degrees.
  const Convex rod = convex(Box{Vec3(2, 1e-3, 1e-3)});
  const Pose start = still_pose({0, 0.5, 0}), end = still_pose({0, 0.5, 0}, 1.2);
  const PosePath turning(start, end), ground{Pose{}};
  const auto impact = time_of_plane_impact({rod, turning}, ground, kTolerance);
  ASSERT_TRUE(impact);
  const Quat q = turning.at(impact->fraction).orientation;
  const Real angle = 2 * std::atan2(q.z(), q.w());
  EXPECT_NEAR(std::sin(angle) + 0.5e-3 * std::cos(angle), 0.5, 2 * kTolerance);
  EXPECT_LE(impact->separation.distance, kTolerance);
  EXPECT_GE(impact->separation.distance, 0);
}

TEST(TimeOfImpact, TiltingPlaneMeetsABall) {
  // A ball rests beside the pivot of a plane that swings up. The time of contact has a closed form.
  const Convex ball = convex(Sphere{0.1});
  const PosePath resting(still_pose({2, 0.5, 0})),
      swinging(still_pose(Vec3::Zero()), still_pose(Vec3::Zero(), 1.0));
  const auto impact = time_of_plane_impact({ball, resting}, swinging, kTolerance);
  ASSERT_TRUE(impact);
  const Vec3 up = swinging.at(impact->fraction).vector_to_world(Vec3::UnitY());
  EXPECT_NEAR(up.dot(Vec3(2, 0.5, 0)), 0.1, 2 * kTolerance);
  const PosePath sinking(still_pose(Vec3::Zero()), still_pose(Vec3(0, -1, 0), -1.0));
  EXPECT_FALSE(time_of_plane_impact({ball, resting}, sinking, kTolerance));
}

TEST(TimeOfImpact, TouchingAtTheStartIsAnImpactAtOnce) {
  const Convex box = convex(Box{Vec3(1, 1, 1)});
  for (const Real height : {1.0, 0.8}) {
    const PosePath sliding(still_pose({0, height, 0}), still_pose({1, height, 0})), resting{Pose{}};
    const auto impact = time_of_impact({box, sliding}, {box, resting}, kTolerance);
    ASSERT_TRUE(impact);
    EXPECT_EQ(impact->fraction, 0);
    EXPECT_NEAR(impact->separation.distance, height - 1, 1e-9);
  }
}

// A round body that turns about its own axis approaches nothing by its rotation. If the rotation counted, a
// wheel just above the floor would need thousands of advances.
TEST(TimeOfImpact, RollingAboveTheFloorNeedsFewAdvances) {
  const Convex floor = convex(Box{Vec3(10, 1, 10)});
  const PosePath resting(still_pose({0, -0.5, 0}));
  const Real height = 0.2 + 1.5 * kTolerance, sunk = 0.2 - kTolerance;
  const std::array<std::pair<Shape, Quat>, 4> wheels = {
      {{Sphere{0.2}, Quat::Identity()},
       {Capsule{0.2, 0.5}, Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitX()))},
       {Cylinder{0.2, 0.1}, Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitX()))},
       {Frustum{0.2, 0.2, 0.1}, Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitX()))}}};
  for (const auto& [shape, orientation] : wheels) {
    const Convex wheel = convex(shape);
    const Quat start = orientation;  // Clang 14 cannot capture `orientation`
    const auto path_to = [&](Real end_height) {
      return PosePath(Pose{Vec3(-0.3, height, 0), start},
                      Pose{Vec3(0.3, end_height, 0), Quat(Eigen::AngleAxisd(-3, Vec3::UnitZ())) * start});
    };
    EXPECT_FALSE(time_of_impact({wheel, path_to(height)}, {floor, resting}, kTolerance)) << shape.index();
    EXPECT_FALSE(time_of_plane_impact({wheel, path_to(height)}, PosePath(Pose{}), kTolerance));
    for (const auto& impact : {time_of_impact({wheel, path_to(sunk)}, {floor, resting}, kTolerance),
                               time_of_plane_impact({wheel, path_to(sunk)}, PosePath(Pose{}), kTolerance)}) {
      ASSERT_TRUE(impact) << shape.index();
      EXPECT_LE(impact->advances, 10) << shape.index();
      EXPECT_NEAR(impact->fraction, 0.3, 0.11) << shape.index();
    }
  }
}

// Conservative advancement is never late, stops within the tolerance, and misses no contact that the fine
// bisection finds.
TEST(TimeOfImpact, AgreesWithFineBisection) {
  const Scatter random{11};
  const std::array<Shape, 5> shapes = {Box{Vec3(1, 0.05, 0.6)}, Capsule{0.1, 0.8}, Cylinder{0.4, 0.1},
                                       Cone{0.3, 0.9}, Sphere{0.3}};
  int impacts = 0;
  for (uint64_t i = 0; i < 400; ++i) {
    const auto u = [&](uint64_t k) { return 2 * random.uniform(i, k) - 1; };
    const auto place = [&](uint64_t k, Real spread) {
      return Pose{spread * Vec3(u(k), u(k + 1), u(k + 2)),
                  Quat(u(k + 3), u(k + 4), u(k + 5), u(k + 6)).normalized()};
    };
    std::vector<Vec3> cloud;
    for (uint64_t k = 0; k < 12; ++k) cloud.push_back(0.5 * Vec3(u(k), u(k + 12), u(k + 24)));
    const ConvexPolyhedron hull = convex_hull(cloud);
    const Convex a = i % 6 == 5 ? convex(hull) : convex(shapes[i % 6]), b = convex(shapes[i / 6 % 5]);
    const PosePath way_a(place(40, 1.2), place(47, 1.2)), way_b(place(54, 0.5), place(54 + 7 * (i % 2), 0.5));
    const MovingConvex moving_a{a, way_a}, moving_b{b, way_b};
    const auto impact = time_of_impact(moving_a, moving_b, kTolerance);
    const auto nearer = bisection(moving_a, moving_b, kTolerance / 2, 300);
    if (nearer) {
      ASSERT_TRUE(impact) << i;
      EXPECT_LE(impact->fraction, *nearer + 1e-11) << i;
    }
    if (!impact) continue;
    ++impacts;
    EXPECT_TRUE(impact->converged) << i;
    EXPECT_LE(distance(moving_a, moving_b, impact->fraction), kTolerance * (1 + 1e-6)) << i;
    for (int k = 0; k < 100 && impact->fraction > 0; ++k)
      EXPECT_GT(distance(moving_a, moving_b, impact->fraction * k / 100), kTolerance / 2 - 1e-9) << i;
  }
  EXPECT_GT(impacts, 100);
}

}  // namespace
}  // namespace offstage::sim
