#include "sim/geometry/convex_hull.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "meshes.h"
#include "random.h"
#include "sim/geometry/mass_properties.h"

namespace offstage::sim {
namespace {

/// Returns the distance of the farthest point outside the hull.
Real excess(const ConvexPolyhedron& hull, const std::vector<Vec3>& points) {
  Real worst = 0;
  for (uint32_t f = 0; f < hull.face_count(); ++f)
    for (const Vec3& p : points) worst = std::max(worst, hull.plane(f).normal.dot(p) - hull.plane(f).offset);
  return worst;
}

long euler_characteristic(const ConvexPolyhedron& p) {
  return static_cast<long>(p.vertices().size()) - static_cast<long>(p.edges().size()) + p.face_count();
}

/// Returns six times the volume of the convex hull of points with small integer coordinates, exactly. Every
/// plane through three points with all others on one side is a face plane; the area of its polygon comes from
/// the pairs of neighbouring corners.
long brute_volume(const std::vector<Vec3>& points) {
  using Int3 = Eigen::Matrix<long, 3, 1>;
  std::vector<Int3> p;
  for (const Vec3& v : points) p.push_back(v.cast<long>());
  std::sort(p.begin(), p.end(), [](const Int3& a, const Int3& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  });
  p.erase(std::unique(p.begin(), p.end()), p.end());
  const std::size_t n = p.size();
  long volume = 0;
  // A directed edge (i, j) with its face on the left: within the plane of the face, no point lies to the
  // right of it, and no point lies above the plane.
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      for (std::size_t k = 0; k < n; ++k) {
        if (i == j || j == k || i == k) continue;
        const Int3 normal = (p[j] - p[i]).cross(p[k] - p[i]);
        if (normal.isZero()) continue;
        // (i, j, k) counts if k is the apex of the fan (the lowest index in the plane) and i, j are
        // neighbours on the hull.
        bool counts = true;
        for (std::size_t m = 0; m < n && counts; ++m) {
          const long height = normal.dot(p[m] - p[i]);
          if (height > 0) counts = false;
          if (height != 0) continue;
          const Int3 turn = (p[j] - p[i]).cross(p[m] - p[i]);
          const long side = turn.dot(normal), along = (p[j] - p[i]).dot(p[m] - p[i]);
          if (side < 0 || m < k) counts = false;
          if (side == 0 && (along < 0 || along > (p[j] - p[i]).squaredNorm())) counts = false;
        }
        if (counts) volume += p[i].dot(p[j].cross(p[k]));
      }
  return volume;
}

TEST(ConvexHull, HoldsItsPointsAndIsConvexAndClosed) {
  const Scatter random{7};
  for (uint64_t round = 0; round < 50; ++round) {
    std::vector<Vec3> points;
    const Real size = std::pow(10, -3 + static_cast<Real>(round % 6));
    for (uint64_t i = 0; i < 10 + 8 * round; ++i)
      points.push_back(size * Vec3(random.uniform(1000 * round + i, 0), random.uniform(1000 * round + i, 1),
                                   5 + random.uniform(1000 * round + i, 2)));
    const ConvexPolyhedron hull = convex_hull(points);
    EXPECT_LE(excess(hull, points), 1e-10 * size * 3);
    EXPECT_LE(concavity(hull), 1e-10 * size * 3);
    EXPECT_EQ(euler_characteristic(hull), 2);
    EXPECT_EQ(hull.dimension(), 3);
  }
}

TEST(ConvexHull, FacesOfGridsAreWholePolygons) {
  std::vector<Vec3> points;
  for (int i = 0; i < 125; ++i) points.push_back(0.1 * Vec3(i % 5, i / 5 % 5, i / 25));
  const ConvexPolyhedron hull = convex_hull(points);
  EXPECT_EQ(hull.vertices().size(), 8u);
  EXPECT_EQ(hull.face_count(), 6u);
  EXPECT_EQ(hull.edges().size(), 12u);
  const Quat turn(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()));
  for (Vec3& p : points) p = turn * p + Vec3(30, -20, 10);
  const ConvexPolyhedron turned = convex_hull(points);
  EXPECT_EQ(turned.vertices().size(), 8u);
  EXPECT_EQ(turned.face_count(), 6u);
}

TEST(ConvexHull, RoundSolidsKeepEveryVertex) {
  const TriangleMesh mesh = sphere_mesh(2, 24, 13);
  const ConvexPolyhedron hull = convex_hull(mesh.vertices);
  EXPECT_EQ(hull.vertices().size(), mesh.vertices.size());
  EXPECT_EQ(hull.face_count(), 24u * 13);  // quadrangles between the rings, triangles at the poles
  EXPECT_NEAR(mass_properties(hull.triangles()).volume, mass_properties(mesh).volume, 1e-12 * 32);
}

// With integer coordinates, all degenerate cases are frequent: duplicates, collinear and coplanar points.
TEST(ConvexHull, VolumeOfGridPointsIsExact) {
  EXPECT_TRUE(rc::check([] {
    const auto coordinate = rc::gen::element<Real>(0, 1, 2, 3);
    const auto count = *rc::gen::resize(100, rc::gen::inRange<std::size_t>(1, 14));
    const auto points = *rc::gen::container<std::vector<Vec3>>(
        count, rc::gen::construct<Vec3>(coordinate, coordinate, coordinate));
    const ConvexPolyhedron hull = convex_hull(points);
    RC_ASSERT(excess(hull, points) <= 1e-9);
    const Real volume = hull.dimension() == 3 ? mass_properties(hull.triangles()).volume : 0;
    RC_ASSERT(std::abs(6 * volume - static_cast<Real>(brute_volume(points))) < 1e-9);
    if (hull.dimension() >= 2) {
      RC_ASSERT(euler_characteristic(hull) == 2);
    }
  }));
}

TEST(ConvexHull, FlatStraightAndSinglePoints) {
  const Vec3 u = Vec3(1, 2, 3).normalized(), v = u.unitOrthogonal();
  std::vector<Vec3> flat, straight;
  for (int i = 0; i < 40; ++i) {
    const Real a = 0.3 * i;
    flat.push_back(Vec3(5, 5, 5) + (1 + i % 2) * (std::cos(a) * u + std::sin(a) * v));
    straight.push_back(Vec3(-3, 0, 8) + std::sin(a) * u);
  }
  const ConvexPolyhedron polygon = convex_hull(flat), segment = convex_hull(straight),
                         point = convex_hull(std::vector<Vec3>(5, Vec3(1, 2, 3)));
  EXPECT_EQ(polygon.dimension(), 2);
  EXPECT_EQ(polygon.face_count(), 2u);
  EXPECT_EQ(polygon.vertices().size(), polygon.edges().size());
  EXPECT_LE(excess(polygon, flat), 1e-9 * 4);
  EXPECT_EQ(segment.dimension(), 1);
  EXPECT_NEAR((segment.vertex(0) - segment.vertex(1)).norm(), 2, 1e-2);
  EXPECT_EQ(segment.vertex_neighbours(0).front(), 1u);
  EXPECT_EQ(point.dimension(), 0);
  EXPECT_EQ(point.vertices().size(), 1u);
}

TEST(ConvexHull, ThinSolidsStayClosed) {
  const Scatter random{3};
  for (int power = 5; power <= 12; ++power) {
    std::vector<Vec3> points;
    for (uint64_t i = 0; i < 60; ++i)
      points.emplace_back(random.uniform(i, 0), std::pow(10, -power) * random.uniform(i, 1),
                          random.uniform(i, 2));
    const ConvexPolyhedron hull = convex_hull(points);
    EXPECT_EQ(euler_characteristic(hull), 2) << power;
    EXPECT_LE(excess(hull, points), 2e-9) << power;
  }
}

TEST(ConvexPolyhedron, AdjacencyOfABox) {
  const ConvexPolyhedron box = box_polyhedron(Vec3(1, 2, 3));
  ASSERT_EQ(box.edges().size(), 12u);
  for (uint32_t e = 0; e < 12; ++e) {
    const auto& edge = box.edge(e);
    const auto left = box.face_vertices(edge.left);
    const auto tail = std::find(left.begin(), left.end(), edge.tail);
    EXPECT_EQ(*(tail + 1 == left.end() ? left.begin() : tail + 1), edge.head) << "runs along its left face";
    EXPECT_LT(box.plane(edge.left).normal.dot(box.plane(edge.right).normal), 1e-15);
  }
  for (uint32_t v = 0; v < 8; ++v) {
    ASSERT_EQ(box.vertex_edges(v).size(), 3u);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& edge = box.edge(box.vertex_edges(v)[k]);
      EXPECT_EQ(edge.tail + edge.head - v, box.vertex_neighbours(v)[k]);
    }
  }
  EXPECT_NEAR(mass_properties(box.triangles()).volume, 6, 1e-14);
}

TEST(ConvexPolyhedron, OpenSurfacesAreRefused) {
  const std::vector<Vec3> vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::vector<std::vector<uint32_t>> open = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}},
                                           missing = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 9}};
  EXPECT_THROW(ConvexPolyhedron(vertices, open), std::invalid_argument);
  EXPECT_THROW(ConvexPolyhedron(vertices, missing), std::invalid_argument);
}

// Products of four coordinates overflow above 1e77 and underflow below 1e-77.
TEST(ConvexHull, IsTheSameAtEveryScale) {
  const std::vector<Vec3> points = box_mesh(Vec3(1, 2, 3)).vertices;
  const ConvexPolyhedron usual = convex_hull(points);
  for (const int exponent : {-265, -1, 1, 265}) {
    std::vector<Vec3> scaled = points;
    for (Vec3& p : scaled) p *= std::ldexp(1.0, exponent);
    const ConvexPolyhedron hull = convex_hull(scaled);
    ASSERT_EQ(hull.face_count(), usual.face_count()) << exponent;
    for (uint32_t f = 0; f < hull.face_count(); ++f)
      EXPECT_LT((hull.plane(f).normal - usual.plane(f).normal).norm(), 1e-15) << exponent;
  }
}

}  // namespace
}  // namespace offstage::sim
