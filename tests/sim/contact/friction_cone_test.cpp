#include "sim/contact/friction_cone.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "tests/convex_samples.h"

namespace offstage::sim {
namespace {

Contact with_friction(Real t, Real k) {
  Contact c;
  c.friction_t = t;
  c.friction_k = k;
  return c;
}

/// Returns a contact with a circular cone or a pyramid, which may be flat, steep, or without friction.
Contact random_cone(Dice& dice) {
  const Real t = dice.chance(0.15) ? 0 : dice.uniform(0, 2), k = dice.chance(0.15) ? 0 : dice.uniform(0, 2);
  return with_friction(t, dice.chance(0.5) ? t : k);
}

bool is_inside(const Contact& c, const Vec3& p, Real slack) {
  if (p.x() < -slack) return false;
  if (c.is_isotropic()) return p.tail<2>().norm() <= c.friction_t * p.x() + slack;
  return std::abs(p.y()) <= c.friction_t * p.x() + slack && std::abs(p.z()) <= c.friction_k * p.x() + slack;
}

// p is the nearest point of a convex cone to q if p . (q - p) = 0 and (q - p) . r <= 0 for all r in the cone.
TEST(FrictionCone, ProjectionIsTheNearestPoint) {
  Dice dice(1);
  for (int i = 0; i < 20'000; ++i) {
    const Contact c = random_cone(dice);
    const Vec3 q = 2 * dice.in_cube();
    const Vec3 p = project_on_cone(c, q).point;
    ASSERT_TRUE(is_inside(c, p, 1e-12)) << q.transpose();
    ASSERT_NEAR(p.dot(q - p), 0, 1e-12);
    ASSERT_LT((project_on_cone(c, p).point - p).norm(), 1e-12);
    for (int k = 0; k < 8; ++k) {
      Vec3 r = dice.in_cube();
      r.x() = std::abs(r.x());
      const Real limit = c.is_isotropic() ? r.tail<2>().norm() : 1;
      r.y() *= c.friction_t * r.x() / std::max(limit, 1e-9);
      r.z() *= c.friction_k * r.x() / std::max(limit, 1e-9);
      ASSERT_LT((q - p).dot(r), 1e-12);
    }
  }
}

// The impulses that the exact solver projects are up to a million times their projections. Rounding must not
// choose another face of the pyramid: the part within the limits stays as it is.
TEST(FrictionCone, ProjectionOfADistantPointIsExact) {
  const Contact c = with_friction(0.02, 0.8);
  Dice dice(4);
  for (int i = 0; i < 1000; ++i) {
    // A point at normal impulse 1 that slides along t and sticks along k.
    const Real slide = dice.uniform(1e4, 1e6), stuck = dice.uniform(-0.79, 0.79);
    const Vec3 q(1 - c.friction_t * slide, c.friction_t + slide, stuck);
    EXPECT_LT((project_on_cone(c, q).point - Vec3(1, c.friction_t, stuck)).norm(), 1e-9) << q.transpose();
  }
}

// A frictionless contact that separates without sliding must get exactly zero impulse.
TEST(FrictionCone, WithoutFrictionNothingPulls) {
  const Contact c = with_friction(0, 0);
  EXPECT_EQ(project_on_cone(c, Vec3(-1, 0, 0)).point, Vec3::Zero());
  EXPECT_EQ(project_on_cone(c, Vec3(-1, 0, 0)).region, ConeRegion::apex);
  EXPECT_EQ(project_on_cone(c, Vec3(2, 0, 0)).point, Vec3(2, 0, 0));
  EXPECT_EQ(project_on_cone(c, Vec3(2, 1, -1)).point, Vec3(2, 0, 0));
  EXPECT_TRUE(cone_derivative(c, Vec3(2, 1, -1), project_on_cone(c, Vec3(2, 1, -1))).allFinite());
}

TEST(FrictionCone, TheCornerCountsAsInside) {
  EXPECT_EQ(project_on_cone(with_friction(0.5, 0.5), Vec3::Zero()).region, ConeRegion::inside);
  EXPECT_EQ(project_on_cone(with_friction(0.5, 0.2), Vec3::Zero()).region, ConeRegion::inside);
}

TEST(FrictionCone, DerivativeAgreesWithDifferences) {
  Dice dice(2);
  constexpr Real kStep = 1e-6;
  int compared = 0;
  for (int i = 0; i < 5000; ++i) {
    const Contact c = random_cone(dice);
    const Vec3 q = 2 * dice.in_cube();
    const ConeProjection at = project_on_cone(c, q);
    const Mat3 D = cone_derivative(c, q, at);
    ASSERT_LT((D - D.transpose()).norm(), 1e-14);
    Mat3 differences;
    bool smooth = q.tail<2>().norm() > 1e-2;
    for (int axis = 0; axis < 3; ++axis) {
      const ConeProjection high = project_on_cone(c, q + kStep * Vec3::Unit(axis)),
                           low = project_on_cone(c, q - kStep * Vec3::Unit(axis));
      smooth &= high.region == at.region && low.region == at.region;
      differences.col(axis) = (high.point - low.point) / (2 * kStep);
    }
    if (!smooth) continue;
    ++compared;
    ASSERT_LT((D - differences).norm(), 1e-6) << q.transpose();
    const Vec3 eigenvalues = Eigen::SelfAdjointEigenSolver<Mat3>(D).eigenvalues();
    ASSERT_GT(eigenvalues.minCoeff(), -1e-12);
    ASSERT_LT(eigenvalues.maxCoeff(), 1 + 1e-12);
  }
  EXPECT_GT(compared, 4000);
}

// With the lift, the velocity u~ of a sliding contact lies in the dual cone: p . u~ >= 0 for all p in the
// cone, and 0 for the p opposite to u.
TEST(FrictionCone, LiftPutsSlidingOnTheDualCone) {
  Dice dice(3);
  for (int i = 0; i < 1000; ++i) {
    const Contact c = random_cone(dice);
    const Vec3 u(0, dice.uniform(-1, 1), dice.uniform(-1, 1));
    const Vec3 lifted = u + cone_lift(c, u) * Vec3::UnitX();
    for (int k = 0; k < 8; ++k) ASSERT_GT(project_on_cone(c, 2 * dice.in_cube()).point.dot(lifted), -1e-12);
    const Vec3 against =
        c.is_isotropic() ? Vec3(1, -c.friction_t * u.y() / u.norm(), -c.friction_t * u.z() / u.norm())
                         : Vec3(1, -std::copysign(c.friction_t, u.y()), -std::copysign(c.friction_k, u.z()));
    ASSERT_NEAR(against.dot(lifted), 0, 1e-12);
  }
}

}  // namespace
}  // namespace offstage::sim
