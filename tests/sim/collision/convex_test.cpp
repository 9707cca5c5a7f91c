#include "sim/collision/convex.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "convex_samples.h"

namespace offstage::sim {
namespace {

/// Points of a primitive's core, including its extreme points.
std::vector<Vec3> points_of(const Convex& c) {
  std::vector<Vec3> points;
  const auto circle = [&](Real radius, Real y) {
    for (int k = 0; k < 360; ++k) {
      const Real phi = k * std::numbers::pi / 180;
      points.emplace_back(radius * std::cos(phi), y, radius * std::sin(phi));
    }
  };
  const Vec3& h = c.half;
  switch (c.core) {
    case Convex::Core::cylinder:
      circle(h.x(), -h.y());
      circle(h.x(), h.y());
      break;
    case Convex::Core::cone:
      circle(h.x(), -h.y());
      points.emplace_back(0, h.y(), 0);
      break;
    default:
      for (int k = 0; k < 8; ++k)
        points.emplace_back(k & 1 ? h.x() : -h.x(), k & 2 ? h.y() : -h.y(), k & 4 ? h.z() : -h.z());
  }
  return points;
}

TEST(Support, OfAPrimitiveIsOnItAndFarthest) {
  const std::vector<Shape> shapes = {Sphere{0.3}, Box{{1, 2, 3}}, Capsule{0.2, 1.5}, Cylinder{0.4, 1.2},
                                     Cone{0.7, 0.9}};
  Dice dice(1);
  for (const Shape& shape : shapes) {
    const Convex c = convex(shape);
    const std::vector<Vec3> points = points_of(c);
    for (int i = 0; i < 1000; ++i) {
      const Vec3 d = i < 6 ? Vec3((i % 2 ? -1 : 1) * Vec3::Unit(i / 2)) : dice.direction();
      uint32_t vertex = 0;
      const Vec3 s = c.support(d, vertex);
      Real farthest = -1e9, nearest = 1e9;
      for (const Vec3& p : points) {
        farthest = std::max(farthest, d.dot(p));
        nearest = std::min(nearest, (p - s).norm());
      }
      EXPECT_GE(d.dot(s), farthest - 1e-15) << shape.index();
      // The sampled circles have a point per degree. Along the axis, the support point of a cap is its
      // centre, which is not a sampled point.
      EXPECT_LE(nearest, i < 6 ? 0.8 : 0.01) << shape.index();
      EXPECT_TRUE(!c.has_vertices() || c.vertex(vertex) == s);
    }
  }
}

TEST(Convex, ReachesAsFarAsItsFarthestPoint) {
  EXPECT_DOUBLE_EQ(convex(Shape(Sphere{0.3})).reach(), 0.3);
  EXPECT_DOUBLE_EQ(convex(Shape(Box{{2, 4, 4}})).reach(), 3);
  EXPECT_DOUBLE_EQ(convex(Shape(Capsule{0.2, 1.5})).reach(), 0.95);
  EXPECT_DOUBLE_EQ(convex(Shape(Cylinder{3, 8})).reach(), 5);
  EXPECT_DOUBLE_EQ(convex(Shape(Cone{3, 8})).reach(), 5);
}

void expect_top_from_anywhere(const ConvexPolyhedron& p, const Vec3& d) {
  Real height = -1e300;
  for (const Vec3& v : p.vertices()) height = std::max(height, d.dot(v));
  const std::size_t stride = 1 + p.vertices().size() / 16;
  for (uint32_t start = 0; start < p.vertices().size(); start += static_cast<uint32_t>(stride))
    ASSERT_GE(d.dot(p.vertex(support_vertex(p, d, start))), height - 4e-16 * p.reach()) << start;
}

TEST(Support, ClimbsToTheTopOfEveryPolyhedron) {
  Dice dice(2);
  for (int i = 0; i < 300; ++i) {
    const ConvexPolyhedron p = random_polyhedron(dice, 150, 1);
    for (int k = 0; k < 20; ++k) expect_top_from_anywhere(p, dice.direction());
    for (uint32_t f = 0; f < p.face_count(); f += 7) {  // exactly along a face normal, and almost so
      expect_top_from_anywhere(p, p.plane(f).normal);
      expect_top_from_anywhere(p, p.plane(f).normal + 1e-12 * dice.direction());
    }
  }
}

/// Returns a lens of 290 triangles. Flattening is an affine map and keeps it convex; noise does not, so the
/// hull is taken again.
ConvexPolyhedron lens(Real thickness, Real noise) {
  std::vector<Vec3> cloud;
  for (int ring = 0; ring <= 6; ++ring)
    for (int k = 0; k < 24; ++k) {
      const Real phi = 2 * std::numbers::pi * (k + 0.5 * (ring % 2)) / 24, r = ring / 6.0;
      cloud.emplace_back(r * std::cos(phi), -r * r, r * std::sin(phi));
    }
  cloud.emplace_back(0, -2, 0);
  const ConvexPolyhedron round = convex_hull(cloud);
  std::vector<Vec3> vertices(round.vertices().begin(), round.vertices().end());
  Dice dice(7);
  for (Vec3& v : vertices) v.y() = thickness * v.y() + noise * dice.uniform(-1, 1);
  std::vector<std::vector<uint32_t>> faces;
  for (uint32_t f = 0; f < round.face_count(); ++f)
    faces.emplace_back(round.face_vertices(f).begin(), round.face_vertices(f).end());
  return {std::move(vertices), faces};
}

// Where height differences are below rounding, a hill climb that compares them can stop anywhere.
TEST(Support, ClimbsFansThatAreAlmostFlat) {
  struct Lens {
    Real thickness, noise;
  };
  for (const auto& [thickness, noise] :
       {Lens{1, 0}, {1e-5, 0}, {1e-9, 1e-10}, {1e-12, 1e-12}, {1e-15, 1e-11}}) {
    const ConvexPolyhedron p = lens(thickness, noise);
    Dice dice(3);
    for (const Real tilt : {0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3})
      for (int k = 0; k < 20; ++k)
        expect_top_from_anywhere(p, (Vec3::UnitY() + tilt * dice.direction()).normalized());
  }
}

}  // namespace
}  // namespace offstage::sim
