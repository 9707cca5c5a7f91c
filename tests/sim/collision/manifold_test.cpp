#include "sim/collision/manifold.h"

#include <algorithm>
#include <numbers>
#include <set>
#include <string>

#include <BulletCollision/CollisionDispatch/btBoxBoxDetector.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <gtest/gtest.h>

#include "sim/collision/distance.h"
#include "sim/collision/gjk.h"
#include "sim/core/rotation.h"
#include "tests/convex_samples.h"

namespace offstage::sim {
namespace {

constexpr Real kPi = std::numbers::pi;

Pose pose_at(const Vec3& position, const Vec3& axis = Vec3::UnitX(), Real angle = 0) {
  return {position, Quat(Eigen::AngleAxisd(angle, axis.normalized()))};
}

Manifold manifold_of(const Convex& a, const Convex& b, const Pose& a_from_b, Real margin) {
  GjkCache fresh;
  return manifold(a, b, a_from_b, gjk(a, b, a_from_b, fresh), margin);
}

std::set<uint32_t> ids(const Manifold& m) {
  std::set<uint32_t> result;
  for (uint32_t k = 0; k < m.count; ++k) result.insert(m.points[k].id);
  return result;
}

/// Returns the area of the largest quadrilateral whose corners are among the given points of a plane with
/// normal n. All orders of the corners are tried.
Real area(const Vec3& n, std::vector<Vec3> p) {
  if (p.size() < 3) return 0;
  const auto triangle = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
    return n.dot((b - a).cross(c - a)) / 2;
  };
  Real best = 0;
  for (const Vec3& a : p)
    for (const Vec3& b : p) {
      Real left = 0, right = 0;
      for (const Vec3& c : p) {
        left = std::max(left, triangle(a, b, c));
        right = std::max(right, -triangle(a, b, c));
      }
      best = std::max(best, left + right);
    }
  return best;
}

Real area(const Manifold& m) {
  std::vector<Vec3> p;
  for (uint32_t k = 0; k < m.count; ++k) p.push_back(m.points[k].on_a);
  return area(m.normal, p);
}

Real deepest(const Manifold& m) {
  Real least = 1e30;
  for (uint32_t k = 0; k < m.count; ++k) least = std::min(least, m.points[k].separation);
  return least;
}

const std::vector<Shape>& solids() {
  static const std::vector<Shape> shapes = {Sphere{0.5},       Box{{1, 0.6, 1.4}}, Box{{2, 0.05, 1}},
                                            Capsule{0.3, 0.9}, Cylinder{0.5, 1.1}, Cylinder{1, 0.05},
                                            Cone{0.6, 1.2}};
  return shapes;
}

Real surface_distance(const Shape& shape, const Vec3& p) {
  return signed_distance(Solid{.shape = &shape}, p).distance;
}

TEST(Manifold, PointsLieOnBothSurfacesAlongTheNormalAndHoldTheDeepest) {
  Dice dice(7);
  // The manifold may differ by this much where a face normal is used (see the header).
  constexpr Real kMargin = 0.02, kTilt = 0.05 * kMargin;
  for (const Shape& a : solids())
    for (const Shape& b : solids())
      for (int k = 0; k < 300; ++k) {
        const Convex ca = convex(a), cb = convex(b);
        Pose a_from_b{3 * dice.direction(), k % 3 ? dice.rotation() : Quat::Identity()};
        GjkCache fresh;
        const Separation far = gjk(ca, cb, a_from_b, fresh);
        a_from_b.position += (far.distance - dice.uniform(-0.01, 0.03)) * far.normal;
        const Separation s = gjk(ca, cb, a_from_b, fresh);
        const Manifold m = manifold(ca, cb, a_from_b, s, kMargin);
        SCOPED_TRACE(std::to_string(a.index()) + " on " + std::to_string(b.index()) + ", " +
                     std::to_string(k));
        ASSERT_EQ(m.count > 0, s.distance <= kMargin);
        if (m.count == 0) continue;
        ASSERT_NEAR(m.normal.norm(), 1, 1e-12);
        ASSERT_NEAR(deepest(m), s.distance, kTilt + 1e-6);
        ASSERT_EQ(ids(m).size(), m.count);
        for (uint32_t i = 0; i < m.count; ++i) {
          const ContactPoint& p = m.points[i];
          ASSERT_LE(p.separation, kMargin);
          ASSERT_LT((p.on_a - p.on_b - p.separation * m.normal).norm(), 1e-12);
          // For a tilted capsule, points other than the deepest may lie inside the shape (see the header).
          const Real on_a = surface_distance(a, p.on_a),
                     on_b = surface_distance(b, a_from_b.point_to_body(p.on_b));
          ASSERT_LT(std::max(on_a, on_b), 2 * kTilt);
          ASSERT_TRUE(on_a > -2 * kTilt || std::holds_alternative<Capsule>(a));
          ASSERT_TRUE(on_b > -2 * kTilt || std::holds_alternative<Capsule>(b));
        }
      }
}

TEST(Manifold, BoxesFaceToFaceMeetInTheRectangleTheyShare) {
  const Convex a = convex(Box{{2, 1, 2}}), b = convex(Box{{1, 1, 3}});
  for (Real gap : {0.01, 1e-9, 0.0, -1e-9, -0.01}) {
    const Manifold m = manifold_of(a, b, pose_at({0.75, -1 - gap, 0.3}), 0.02);
    ASSERT_EQ(m.count, 4u);
    EXPECT_LT((m.normal - Vec3::UnitY()).norm(), 1e-12);
    EXPECT_NEAR(deepest(m), gap, 1e-12);
    EXPECT_NEAR(area(m), 0.75 * 2, 1e-4);
  }
}

TEST(Manifold, OfAnOctagonFourCornersKeepTheLargestArea) {
  const Convex box = convex(Box{Vec3::Ones()});
  const Manifold m = manifold_of(box, box, pose_at({0, -1, 0}, Vec3::UnitY(), kPi / 4), 0.01);
  ASSERT_EQ(m.count, 4u);
  const Real corner = 0.5 / std::cos(kPi / 8);
  EXPECT_NEAR(area(m), 2 * corner * corner, 1e-4);
}

TEST(Manifold, ABoxThatRocksALittleKeepsItsFourPointsAndTheirIds) {
  const Convex slab = convex(Box{{4, 1, 4}}), box = convex(Box{Vec3::Ones()});
  const ConvexPolyhedron polyhedron = box_polyhedron(Vec3::Ones());
  Dice dice(3);
  for (const Convex& b : {box, convex(polyhedron)}) {
    const std::set<uint32_t> names = ids(manifold_of(slab, b, pose_at({0.2, -1, 0.1}), 0.01));
    ASSERT_EQ(names.size(), 4u);
    for (int k = 0; k < 500; ++k) {
      const Real tilt = std::pow(10, dice.uniform(-9, -3.5));
      Pose rocked = pose_at({0.2, -1 + dice.uniform(-1e-4, 1e-4), 0.1}, dice.direction(), tilt);
      const Manifold m = manifold_of(slab, b, rocked, 0.01);
      ASSERT_EQ(ids(m), names) << "tilt " << tilt;
      ASSERT_LT((m.normal - Vec3::UnitY()).norm(), 2e-3);
    }
  }
}

// Boxes of equal size stacked on each other: their sides are coplanar, and rounding must not decide which
// vertices are reported.
TEST(Manifold, AStackOfEqualBoxesKeepsItsIdsWhileItCreeps) {
  const Convex box = convex(Box{Vec3::Ones()});
  Dice dice(5);
  const std::set<uint32_t> names = ids(manifold_of(box, box, pose_at({0, -1, 0}), 0.01));
  ASSERT_EQ(names.size(), 4u);
  for (int k = 0; k < 500; ++k) {
    const Vec3 creep = 3e-6 * dice.in_cube();
    ASSERT_EQ(ids(manifold_of(box, box, pose_at(Vec3(0, -1, 0) + creep, dice.direction(), 1e-6), 0.01)),
              names);
  }
}

// Here a pair of crossing edges often has slightly less penetration than the faces, and would be selected in
// some steps only.
TEST(Manifold, TwistedBoxesOnEachOtherKeepTheFaceNormalWhileTheyRock) {
  const Convex box = convex(Box{Vec3::Ones()});
  const Quat twist(Eigen::AngleAxisd(kPi / 4, Vec3::UnitY()));
  Dice dice(19);
  for (int k = 0; k < 500; ++k) {
    const Quat rock(Eigen::AngleAxisd(dice.uniform(0, 3e-4), dice.direction()));
    const Manifold m = manifold_of(box, box, {{0, -1 + dice.uniform(-1e-4, 5e-4), 0}, rock * twist}, 0.01);
    ASSERT_TRUE(m.source == NormalSource::face_of_a || m.source == NormalSource::face_of_b);
    ASSERT_EQ(m.count, 4u);
    ASSERT_GT(area(m), 0.5);
  }
}

TEST(Manifold, AnEdgeOnAFaceHasTwoPointsAndAVertexOne) {
  const Convex box = convex(Box{Vec3::Ones()}), slab = convex(Box{{4, 1, 4}});
  const Manifold edge =
      manifold_of(slab, box, pose_at({0, -0.5 - std::sqrt(0.5), 0}, Vec3::UnitX(), kPi / 4), 0.01);
  ASSERT_EQ(edge.count, 2u);
  EXPECT_EQ(edge.source, NormalSource::face_of_a);
  EXPECT_NEAR((edge.points[0].on_a - edge.points[1].on_a).norm(), 1, 1e-12);
  const Pose on_corner{Vec3(0, -0.5 - std::sqrt(0.75), 0), rotation_between(Vec3::Ones(), Vec3::UnitY())};
  const Manifold vertex = manifold_of(slab, box, on_corner, 0.01);
  ASSERT_EQ(vertex.count, 1u);
  EXPECT_NEAR(vertex.points[0].separation, 0, 1e-12);
}

// Two beams of 3 m, one on the other. Each stands on one of its edges.
TEST(Manifold, EdgesMeetInTwoPointsAlongEachOtherAndInOneAcross) {
  const ConvexPolyhedron upright = box_polyhedron({3, 1, 1});
  std::vector<Vec3> corners;
  for (const Vec3& p : upright.vertices())
    corners.push_back(pose_at(Vec3::Zero(), Vec3::UnitX(), kPi / 4).vector_to_world(p));
  const ConvexPolyhedron beam = convex_hull(corners);
  const Real y = -2 * std::sqrt(0.5) - 0.001;
  const Manifold along = manifold_of(convex(beam), convex(beam), pose_at({1.5, y, 0}), 0.01);
  ASSERT_EQ(along.count, 2u);
  EXPECT_EQ(along.source, NormalSource::edge_of_b);
  EXPECT_NEAR((along.points[0].on_a - along.points[1].on_a).norm(), 1.5, 1e-9);
  const Manifold across =
      manifold_of(convex(beam), convex(beam), pose_at({0.2, y, 0}, Vec3::UnitY(), 1), 0.01);
  ASSERT_EQ(across.count, 1u);
  EXPECT_EQ(across.source, NormalSource::edges);
  EXPECT_NEAR(across.points[0].separation, 0.001, 1e-12);
}

TEST(Manifold, RoundSolidsRestOnTheirLinesAndDiscs) {
  const Convex slab = convex(Box{{4, 1, 4}}), cylinder = convex(Cylinder{0.4, 1.2}),
               capsule = convex(Capsule{0.3, 1}), cone = convex(Cone{0.5, 1}), ball = convex(Sphere{0.5});
  const Manifold standing = manifold_of(slab, cylinder, pose_at({0, -1.1, 0}), 0.01);
  ASSERT_EQ(standing.count, 4u);
  EXPECT_NEAR(area(standing), 2 * 0.16, 1e-9);
  const Manifold lying = manifold_of(slab, cylinder, pose_at({0, -0.9, 0}, Vec3::UnitX(), kPi / 2), 0.01);
  ASSERT_EQ(lying.count, 2u);
  EXPECT_NEAR((lying.points[0].on_a - lying.points[1].on_a).norm(), 1.2, 1e-12);
  const Manifold stacked = manifold_of(cylinder, cylinder, pose_at({0, 1.2, 0}), 0.01);
  ASSERT_EQ(stacked.count, 4u);
  EXPECT_NEAR(area(stacked), 2 * 0.16, 1e-9);
  const Manifold crossed =
      manifold_of(cylinder, cylinder, {{0, 0, 0.8}, Quat(Eigen::AngleAxisd(1, Vec3::UnitZ()))}, 0.01);
  ASSERT_EQ(crossed.count, 1u);
  EXPECT_EQ(crossed.source, NormalSource::edges);
  const Manifold side_by_side = manifold_of(cylinder, capsule, pose_at({0.7, 0.4, 0}), 0.01);
  ASSERT_EQ(side_by_side.count, 2u);
  EXPECT_NEAR((side_by_side.points[0].on_a - side_by_side.points[1].on_a).norm(), 0.7, 1e-9);
  EXPECT_EQ(manifold_of(slab, cone, pose_at({0, -1, 0}, Vec3::UnitX(), kPi), 0.01).count, 4u);
  const Real slope = std::atan2(0.5, 1);  // half angle of the cone: its side line lies flat
  EXPECT_EQ(manifold_of(slab, cone,
                        pose_at({0, -0.5 - 0.5 * std::sin(slope), 0}, Vec3::UnitX(), slope - kPi / 2), 0.01)
                .count,
            2u);
  EXPECT_EQ(manifold_of(slab, cone, pose_at({0, -1, 0}), 0.01).count, 1u);
  const Manifold sphere = manifold_of(slab, ball, pose_at({0.3, -1, 0.2}), 0.01);
  ASSERT_EQ(sphere.count, 1u);
  EXPECT_LT((sphere.points[0].on_a - Vec3(0.3, -0.5, 0.2)).norm(), 1e-12);
  EXPECT_EQ(manifold_of(ball, ball, pose_at({1, 0, 0}), 0.01).source, NormalSource::points);
}

// A flat bottom, triangulated with corners that are rounded as in a model file, is still one face.
TEST(Manifold, AFloorOfAlmostCoplanarTrianglesIsOneFace) {
  Dice dice(11);
  std::vector<Vec3> points;
  for (int k = 0; k < 12; ++k) {
    const Vec3 rim(std::cos(kPi * k / 6), 0, std::sin(kPi * k / 6));
    points.push_back(rim + 1e-6 * dice.in_cube());
    points.push_back(1.2 * rim + Vec3::UnitY());
  }
  const ConvexPolyhedron drum = convex_hull(points);
  const Manifold m = plane_manifold(convex(drum), pose_at({0, 1e-5, 0}), 0.01);
  ASSERT_EQ(m.count, 4u);
  EXPECT_NEAR(area(m), 2, 0.02);
  const Manifold on_slab = manifold_of(convex(drum), convex(Box{{4, 1, 4}}), pose_at({0, -0.5, 0}), 0.01);
  ASSERT_EQ(on_slab.count, 4u);
  EXPECT_NEAR(area(on_slab), 2, 0.02);
}

// A solid with a bottom of 48 sides and a gentle slope around it, as the hull of a torus. Its sides at a
// corner are almost in line and much shorter than the slope is wide, but the bottom is larger.
TEST(Manifold, ABottomOfManySidesIsWiderThanTheSlopeBesideIt) {
  std::vector<Vec3> corners;
  for (int k = 0; k < 48; ++k) {
    const Real angle = kPi * k / 24;
    corners.push_back({0.3 * std::cos(angle), 0, 0.3 * std::sin(angle)});
    corners.push_back({0.4 * std::cos(angle), 0.002, 0.4 * std::sin(angle)});
  }
  const ConvexPolyhedron solid = convex_hull(corners);
  const Convex a = convex(solid), b = convex(Box{{4, 1, 4}});
  const Manifold m = manifold_of(a, b, pose_at({0, -0.5, 0}), 0.01);
  ASSERT_EQ(m.count, 4u);
  EXPECT_LT((m.normal - Vec3::UnitY()).norm(), 1e-9);
  EXPECT_NEAR(area(m), 2 * 0.3 * 0.3, 0.02 * 2 * 0.3 * 0.3);
}

// The ends lean outwards less steeply than the sides, so the face that most nearly faces the ground is an
// end.
TEST(Manifold, ABladeStandsOnBothEndsOfItsEdge) {
  const std::vector<Vec3> points = {{-1, 0, 0},  {1, 0, 0},     {-3, 1, 0.1},
                                    {3, 1, 0.1}, {-3, 1, -0.1}, {3, 1, -0.1}};
  const ConvexPolyhedron blade = convex_hull(points);
  EXPECT_EQ(plane_manifold(convex(blade), pose_at(Vec3::Zero()), 0.01).count, 2u);
  EXPECT_EQ(manifold_of(convex(blade), convex(Box{{8, 1, 8}}), pose_at({0, -0.5, 0}), 0.01).count, 2u);
}

TEST(Manifold, OnAPlaneTheLowestPointsAreExact) {
  Dice dice(13);
  for (const Shape& shape : solids())
    for (int k = 0; k < 500; ++k) {
      Pose p{Vec3::Zero(),
             k % 4 ? dice.rotation() : Quat(Eigen::AngleAxisd(dice.uniform(0, 0.02), dice.direction()))};
      const Real lowest = -support(Solid{.shape = &shape}, p.vector_to_body(-Vec3::UnitY()));
      const Real gap = dice.uniform(-0.02, 0.02);
      p.position.y() = gap - lowest;
      const Manifold m = plane_manifold(convex(shape), p, 0.01);
      ASSERT_EQ(m.count > 0, gap <= 0.01);
      if (m.count == 0) continue;
      ASSERT_NEAR(deepest(m), gap, 2.1e-5) << shape.index();
      for (uint32_t i = 0; i < m.count; ++i) {
        const Real on_a = surface_distance(shape, p.point_to_body(m.points[i].on_a));
        ASSERT_LT(on_a, 1e-9);
        ASSERT_TRUE(on_a > -1e-9 || std::holds_alternative<Capsule>(shape));
        ASSERT_EQ(m.points[i].on_b.y(), 0);
      }
    }
  const Manifold box =
      plane_manifold(convex(Box{{1, 1, 2}}), pose_at({5, 0.4999, 3}, Vec3::UnitX(), 1e-6), 0.01);
  ASSERT_EQ(box.count, 4u);
  EXPECT_NEAR(area(box), 2, 1e-6);
}

struct BulletContact : btDiscreteCollisionDetectorInterface::Result {
  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}
  void addContactPoint(const btVector3& n, const btVector3& p, btScalar depth) override {
    normal = Vec3(n.x(), n.y(), n.z());
    points.emplace_back(p.x(), p.y(), p.z());
    deepest = std::min(deepest, Real{depth});
  }
  Vec3 normal = Vec3::Zero();
  std::vector<Vec3> points;
  Real deepest = 1e30;
};

BulletContact bullet_boxes(const Vec3& a, const Vec3& b, const Pose& a_from_b) {
  const auto vector = [](const Vec3& v) {
    return btVector3(static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()),
                     static_cast<btScalar>(v.z()));
  };
  const btBoxShape box_a(vector(a / 2)), box_b(vector(b / 2));
  const Quat& q = a_from_b.orientation;
  btDiscreteCollisionDetectorInterface::ClosestPointInput input;
  input.m_transformA.setIdentity();
  input.m_transformB = btTransform(btQuaternion(static_cast<btScalar>(q.x()), static_cast<btScalar>(q.y()),
                                                static_cast<btScalar>(q.z()), static_cast<btScalar>(q.w())),
                                   vector(a_from_b.position));
  BulletContact result;
  btBoxBoxDetector(&box_a, &box_b).getClosestPoints(input, result, nullptr);
  return result;
}

// Bullet takes a face normal unless an edge pair is better by 5 %. Where it finds our normal, it must find
// our depth and at most our area. For edge pairs Bullet adds 1e-5 to the cosines, so its depth has an error
// of 1e-5 times the size, divided by the sine of the angle between the edges; ours is exact.
TEST(Manifold, BoxesAgreeWithBullet) {
  Dice dice(17);
  int compared = 0, overlapping = 0;
  for (int k = 0; k < 3000; ++k) {
    const Vec3 a = Vec3::Constant(1.5) + dice.in_cube(), b = Vec3::Constant(1.5) + dice.in_cube();
    const Convex ca = convex(Box{a}), cb = convex(Box{b});
    Pose a_from_b{3 * dice.direction(),
                  k % 2 ? dice.rotation() : Quat(Eigen::AngleAxisd(dice.uniform(0, 6), Vec3::UnitY()))};
    GjkCache fresh;
    const Separation far = gjk(ca, cb, a_from_b, fresh);
    a_from_b.position += (far.distance + dice.uniform(0.001, 0.1)) * far.normal;
    const Manifold m = manifold_of(ca, cb, a_from_b, 0);
    const BulletContact other = bullet_boxes(a, b, a_from_b);
    ASSERT_GT(m.count, 0u);
    if (other.points.empty()) continue;
    ++overlapping;
    if ((other.normal - m.normal).norm() > 1e-5) continue;
    ++compared;
    const Real sine = m.source == NormalSource::edges ? m.edge_a.cross(m.edge_b).norm() : 1;
    ASSERT_NEAR(other.deepest, deepest(m), 1e-5 + 4e-5 / sine) << k;
    ASSERT_GE(area(m), 0.8 * area(m.normal, other.points) - 1e-3) << k;
  }
  EXPECT_GT(overlapping, 2900);
  EXPECT_GT(compared, 0.8 * overlapping);
}

}  // namespace
}  // namespace offstage::sim
