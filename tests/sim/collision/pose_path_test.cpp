#include "sim/collision/pose_path.h"

#include <gtest/gtest.h>

#include "random.h"

namespace offstage::sim {
namespace {

Pose random_start(const Scatter& random, uint64_t i) {
  const auto u = [&](uint64_t k) { return 2 * random.uniform(i, k) - 1; };
  return {Vec3(u(0), u(1), u(2)), Quat(u(3), u(4), u(5), u(6)).normalized()};
}

TEST(PosePath, VelocitiesAreTheDerivativeOfThePath) {
  const Scatter random{4};
  for (uint64_t i = 0; i < 100; ++i) {
    const PosePath path(random_start(random, 2 * i), random_start(random, 2 * i + 1));
    const Vec3 p(0.3, -0.4, 1.2);
    for (const Real s : {0.0, 0.1, 0.5, 0.8, 1.0}) {
      const Real h = 1e-6;
      const Vec3 measured = (path.at(s + h).point_to_world(p) - path.at(s - h).point_to_world(p)) / (2 * h);
      const Vec3 r = path.at(s).vector_to_world(p);
      EXPECT_LT((path.velocity() + path.angular_velocity(s).cross(r) - measured).norm(), 1e-7);
      const Vec3 second = (path.at(s + 1e-4).point_to_world(p) - 2 * path.at(s).point_to_world(p) +
                           path.at(s - 1e-4).point_to_world(p)) /
                          1e-8;
      EXPECT_LE(second.norm(), path.max_acceleration(p.norm()) * (1 + 1e-4));
    }
    EXPECT_LT((path.at(1).point_to_world(p) - path.end().point_to_world(p)).norm(), 1e-14);
    EXPECT_NEAR(path.turn(), path.start().orientation.angularDistance(path.end().orientation), 1e-7);
  }
}

TEST(PosePath, StraightPathsDoNotTurn) {
  Pose a, b;
  a.orientation = b.orientation = Quat(Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized()));
  b.position = Vec3(3, 0, 0);
  const PosePath path(a, b);
  EXPECT_EQ(path.turn(), 0);
  EXPECT_EQ(path.max_acceleration(5), 0);
  EXPECT_EQ(path.at(0.5).orientation.coeffs(), a.orientation.coeffs());
  b.orientation.coeffs() = -b.orientation.coeffs();  // the opposite quaternion is the same orientation
  EXPECT_EQ(PosePath(a, b).turn(), 0);
}

}  // namespace
}  // namespace offstage::sim
