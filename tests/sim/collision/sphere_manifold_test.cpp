#include "sim/collision/sphere_manifold.h"

#include <gtest/gtest.h>

#include "sim/collision/gjk.h"
#include "tests/convex_samples.h"

namespace offstage::sim {
namespace {

Pose inverse(const Pose& p) {
  return {p.point_to_body(Vec3::Zero()), p.orientation.conjugate()};
}

std::vector<Convex> sphere_partners(Real size) {
  return {convex(Sphere{size}), convex(Capsule{0.3 * size, 1.2 * size}), convex(Capsule{0.4 * size, 0}),
          convex(Box{{size, 0.6 * size, 1.7 * size}})};
}

Manifold found(const Convex& a, const Convex& b, const Pose& a_from_b, Real margin) {
  Manifold m;
  sphere_manifold(a, Pose{}, b, a_from_b, margin, m);
  return m;
}

TEST(SphereManifold, AgreesWithGjk) {
  Dice dice(3);
  int contacts = 0;
  for (int k = 0; k < 20000; ++k) {
    const Real size = std::pow(10, dice.uniform(-3, 2)), margin = 0.1 * size;
    const Convex ball = convex(Sphere{size * std::pow(10, dice.uniform(-2, 0))});
    const Convex other = sphere_partners(size)[dice.index(4)];
    ASSERT_TRUE(is_sphere_pair(ball, other) && is_sphere_pair(other, ball));
    const Pose pose{1.5 * size * dice.in_cube(), dice.chance(0.2) ? Quat::Identity() : dice.rotation()};
    GjkCache fresh;
    const Separation s = gjk(other, ball, pose, fresh);
    const Manifold m = found(other, ball, pose, margin);
    SCOPED_TRACE(k);
    ASSERT_EQ(m.count, s.distance <= margin ? 1u : 0u);
    if (m.count == 0) continue;
    ++contacts;
    const ContactPoint& p = m.points[0];
    ASSERT_NEAR(p.separation, s.distance, 1e-12 * size);
    ASSERT_LT((m.normal - s.normal).norm(), 1e-6);
    ASSERT_LT((p.on_a - s.on_a).norm() + (p.on_b - s.on_b).norm(), 1e-6 * size);
    ASSERT_LT((p.on_a - p.on_b - p.separation * m.normal).norm(), 1e-14 * size);
    // The same pair with the ball as the first shape.
    const Manifold seen = found(ball, other, inverse(pose), margin);
    ASSERT_EQ(seen.count, 1u);
    ASSERT_NEAR(seen.points[0].separation, p.separation, 1e-13 * size);
    ASSERT_LT((pose.vector_to_world(seen.normal) + m.normal).norm(), 1e-9);
    ASSERT_LT((pose.point_to_world(seen.points[0].on_a) - p.on_b).norm(), 1e-9 * size);
  }
  EXPECT_GT(contacts, 3000);
}

TEST(SphereManifold, TheNormalComesFromTheClosestFeature) {
  const Convex box = convex(Box{{2, 2, 2}}), capsule = convex(Capsule{0.25, 1}), ball = convex(Sphere{0.5});
  const auto of = [&](const Convex& a, const Vec3& at) {
    return found(a, ball, {at, Quat::Identity()}, 0.1);
  };
  const Manifold face = of(box, {0.3, 1.5, 0.2}), edge = of(box, {1.3, 1.4, 0.2}),
                 vertex = of(box, {1.2, 1.2, 1.2}), inside = of(box, {0.9, 0.3, 0.2}),
                 side = of(capsule, {0.7, 0.1, 0}), end = of(capsule, {0, 1.2, 0});
  EXPECT_EQ(face.source, NormalSource::face_of_a);
  EXPECT_EQ(face.points[0].separation, 0);
  EXPECT_EQ(edge.source, NormalSource::edge_of_a);
  EXPECT_EQ(edge.edge_a, Vec3::UnitZ());
  EXPECT_EQ(edge.radius_b, 0.5) << "the normal turns about the ball's centre";
  EXPECT_EQ(edge.radius_a, 0);
  EXPECT_NEAR(edge.points[0].separation, 0, 1e-15);
  EXPECT_EQ(vertex.source, NormalSource::points);
  EXPECT_EQ(inside.source, NormalSource::face_of_a);
  EXPECT_NEAR(inside.points[0].separation, -0.6, 1e-15);
  EXPECT_EQ(side.source, NormalSource::edge_of_a);
  EXPECT_EQ(side.edge_a, Vec3::UnitY());
  EXPECT_EQ(side.radius_a, 0.25);
  EXPECT_EQ(end.source, NormalSource::points);
  EXPECT_NEAR(end.points[0].separation, -0.05, 1e-15);
  EXPECT_NE(face.points[0].id, edge.points[0].id);
  EXPECT_NE(edge.points[0].id, vertex.points[0].id);
}

TEST(SphereManifold, CoincidentCentresHaveANormal) {
  const Convex ball = convex(Sphere{0.5});
  for (const Convex& other : sphere_partners(1)) {
    const Manifold m = found(other, ball, {}, 0.1);
    ASSERT_EQ(m.count, 1u);
    EXPECT_EQ(m.normal.norm(), 1);
    EXPECT_TRUE(m.points[0].on_a.allFinite() && m.points[0].on_b.allFinite());
    EXPECT_LT(m.points[0].separation, -0.7);
  }
}

}  // namespace
}  // namespace offstage::sim
