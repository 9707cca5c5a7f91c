#include "sim/collision/vclip.h"

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "sim/core/rotation.h"
#include "tests/convex_samples.h"

namespace offstage::sim {
namespace {

using Kind = Feature::Kind;

Pose placed_at(const Vec3& position, const Quat& orientation = Quat::Identity()) {
  return {position, orientation};
}

Separation cold_start(const ConvexPolyhedron& a, const ConvexPolyhedron& b, const Pose& a_from_b) {
  VclipCache cache;
  return vclip(a, b, a_from_b, cache);
}

std::vector<Feature> features(const ConvexPolyhedron& p) {
  std::vector<Feature> all;
  for (uint32_t i = 0; i < p.vertices().size(); ++i) all.push_back({Kind::vertex, i});
  for (uint32_t i = 0; i < p.edges().size(); ++i) all.push_back({Kind::edge, i});
  for (uint32_t i = 0; i < p.face_count(); ++i) all.push_back({Kind::face, i});
  return all;
}

/// Unit cubes. A corner, edge or face of B points at one of A, at a distance of 0.1 along the line from A's
/// centre through that feature.
TEST(Vclip, FindsTheFeaturesAndTheirDistance) {
  const ConvexPolyhedron cube = box_polyhedron(Vec3::Ones());
  const Vec3 corner(0.5, 0.5, 0.5), edge(0.5, 0.5, 0), face(0.5, 0, 0);
  struct Case {
    Vec3 from, to;  // points of the two features: on B in its own frame, and on A
    Kind kind_a, kind_b;
  };
  for (const Case& c :
       {Case{corner, corner, Kind::vertex, Kind::vertex}, Case{corner, edge, Kind::edge, Kind::vertex},
        Case{edge, corner, Kind::vertex, Kind::edge}, Case{corner, face, Kind::face, Kind::vertex},
        Case{face, corner, Kind::vertex, Kind::face},
        Case{Vec3(0.5, 0, 0.5), edge, Kind::edge, Kind::edge}}) {
    const Vec3 n = c.to.normalized();
    const Quat turn = Quat(Eigen::AngleAxisd(0.3, n)) * rotation_between(c.from, -n);
    const Vec3 gap = 0.1 * n;
    VclipCache cache;
    const Separation s = vclip(cube, cube, placed_at(c.to + gap - turn * c.from, turn), cache);
    EXPECT_EQ(cache.a.kind, c.kind_a);
    EXPECT_EQ(cache.b.kind, c.kind_b);
    EXPECT_NEAR(s.distance, 0.1, 1e-15);
    EXPECT_LT((s.normal + n).norm(), 1e-14);
    EXPECT_LT((s.on_a - c.to).norm(), 1e-14);
    EXPECT_LT((s.on_b - c.to - gap).norm(), 1e-14);
    EXPECT_TRUE(s.converged);
  }
}

TEST(Vclip, StartsFromAnyFeatures) {
  Dice dice(1);
  for (int k = 0; k < 40; ++k) {
    const ConvexPair pair = random_pair(dice, 8);
    const Real exact = pair.exact().distance;
    for (const Feature& a : features(pair.a))
      for (const Feature& b : features(pair.b)) {
        VclipCache cache{a, b};
        ASSERT_NEAR(vclip(pair.a, pair.b, pair.a_from_b, cache).distance, exact, 1e-11 * pair.size());
      }
  }
}

// The search starts at the cube's far face: the vertex lies in the face's Voronoi prism, below its plane, and
// all edges lead farther away.
TEST(Vclip, AVertexUnderAFaceEscapesToTheFaceItIsOver) {
  const ConvexPolyhedron cube = box_polyhedron(Vec3::Ones());
  const ConvexPolyhedron tip = convex_hull(std::vector<Vec3>{{0, 0, 0}, {1, 1, 0}, {1, -1, 1}, {1, -1, -1}});
  for (uint32_t f = 0; f < cube.face_count(); ++f) {
    VclipCache cache{{Kind::vertex, 0}, {Kind::face, f}};
    const Separation s = vclip(tip, cube, placed_at({-0.8, 0, 0}), cache);
    EXPECT_NEAR(s.distance, 0.3, 1e-15);
    ASSERT_EQ(cache.b.kind, Kind::face);
    EXPECT_EQ(cube.plane(cache.b.index).normal, Vec3(Vec3::UnitX()));
    EXPECT_LE(s.iterations, 3);
  }
  VclipCache inside{{Kind::vertex, 0}, {Kind::face, 0}};
  EXPECT_NEAR(vclip(tip, cube, placed_at({-0.4, 0, 0}), inside).distance, -0.1, 1e-12);
}

TEST(Vclip, AnEdgeThroughAFaceIsPenetration) {
  const ConvexPolyhedron slab = box_polyhedron({2, 0.2, 2}), spike = box_polyhedron({0.1, 6, 0.1});
  const Separation s = cold_start(slab, spike, placed_at({0.9, 0, 0}));
  EXPECT_NEAR(s.distance, -0.15, 1e-12);
  EXPECT_LT((s.normal + Vec3::UnitX()).norm(), 1e-12);
}

TEST(Vclip, PolygonsSegmentsAndPoints) {
  const ConvexPolyhedron square =
      convex_hull(std::vector<Vec3>{{1, 0, 1}, {1, 0, -1}, {-1, 0, 1}, {-1, 0, -1}});
  const ConvexPolyhedron rod = convex_hull(std::vector<Vec3>{{-2, 0, 0}, {2, 0, 0}});
  const ConvexPolyhedron point = convex_hull(std::vector<Vec3>{{0, 0, 0}});
  const Quat upright(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitZ())),
      aside(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitY()));
  for (const Real y : {0.25, -0.25}) {
    EXPECT_NEAR(cold_start(square, square, placed_at({0.5, y, 0.3})).distance, 0.25, 1e-15);
    EXPECT_NEAR(cold_start(square, rod, placed_at({0.5, y, 0.3})).distance, 0.25, 1e-15);
    EXPECT_NEAR(cold_start(square, point, placed_at({0.5, y, 0.3})).distance, 0.25, 1e-15);
    EXPECT_NEAR(cold_start(rod, rod, placed_at({0.5, y, 0.3}, aside)).distance, 0.25, 1e-15);
    EXPECT_NEAR(cold_start(rod, point, placed_at({0.5, y, 0})).distance, 0.25, 1e-15);
  }
  EXPECT_NEAR(cold_start(square, square, placed_at({2.5, 0, 0})).distance, 0.5, 1e-15);  // coplanar
  EXPECT_NEAR(cold_start(rod, rod, placed_at({5, 0, 0})).distance, 1, 1e-15);            // collinear
  EXPECT_NEAR(cold_start(point, point, placed_at({3, 4, 0})).distance, 5, 1e-15);
  EXPECT_NEAR(cold_start(square, rod, placed_at({0.4, 0, 0.2}, upright)).distance, -0.6, 1e-12);
  EXPECT_NEAR(cold_start(rod, rod, placed_at({0.5, 0, 0}, aside)).distance, 0, 1e-12);
  EXPECT_NEAR(cold_start(point, point, placed_at(Vec3::Zero())).distance, 0, 1e-12);
  EXPECT_NEAR(cold_start(square, point, placed_at({1, 0, 1})).distance, 0, 1e-12);
}

ConvexPolyhedron ball(Dice& dice, int vertices) {
  std::vector<Vec3> points;
  for (int k = 0; k < vertices; ++k) points.push_back(dice.direction());
  return convex_hull(points);
}

TEST(Vclip, AlongASmoothMotionOneStepSuffices) {
  Dice dice(2);
  const ConvexPolyhedron a = ball(dice, 100), b = ball(dice, 100);
  VclipCache cache;
  constexpr int kSteps = 2000;
  int steps = 0;
  for (int k = 0; k < kSteps; ++k) {
    const Real t = 0.01 * k;
    const Pose pose = placed_at({2.1 + 0.1 * std::sin(t), 0.3 * std::cos(0.7 * t), 0.2 * std::sin(1.3 * t)},
                                Quat(Eigen::AngleAxisd(0.3 * t, Vec3(1, 2, 3).normalized())));
    const Separation s = vclip(a, b, pose, cache);
    ASSERT_NEAR(s.distance, cold_start(a, b, pose).distance, 1e-14);
    steps += s.iterations;
  }
  EXPECT_LT(steps, 1.2 * kSteps);
}

// Many features are parallel and equally near: rounding must neither make the search cycle nor move it to
// other features.
TEST(Vclip, ParallelBoxesHaveExactGapsAndStableFeatures) {
  Dice dice(3);
  const ConvexPolyhedron cube = box_polyhedron(Vec3::Ones());
  for (int k = 0; k < 200; ++k) {
    const Quat turn(Eigen::AngleAxisd(0.5 * std::numbers::pi * dice.index(4), Vec3::UnitY()));
    Vec3 gap(dice.index(3) * 0.5, 1.25, dice.index(3) * 0.5);
    VclipCache cache;
    EXPECT_NEAR(vclip(cube, cube, placed_at(gap, turn), cache).distance, 0.25, 1e-14);
    for (int step = 0; step < 20; ++step) {
      gap += 1e-15 * dice.in_cube();
      const Separation s = vclip(cube, cube, placed_at(gap, turn), cache);
      EXPECT_NEAR(s.distance, 0.25, 1e-13);
      EXPECT_LE(s.iterations, 3);
    }
  }
}

TEST(Vclip, IsSymmetricAndMovesWithTheSolids) {
  EXPECT_TRUE(rc::check("distance of B and A, and in another frame", [](uint64_t seed) {
    Dice dice(seed);
    const ConvexPair pair = random_pair(dice, 12);
    const Separation s = cold_start(pair.a, pair.b, pair.a_from_b);
    const Quat back = pair.a_from_b.orientation.conjugate();
    const Separation t = cold_start(pair.b, pair.a, placed_at(back * -pair.a_from_b.position, back));
    RC_ASSERT(std::abs(s.distance - t.distance) <= 1e-10 * pair.size());

    const Quat turn = dice.rotation();
    std::vector<Vec3> turned;
    for (const Vec3& v : pair.a.vertices()) turned.push_back(turn * v);
    std::vector<std::vector<uint32_t>> faces;
    for (uint32_t f = 0; f < pair.a.face_count(); ++f)
      faces.emplace_back(pair.a.face_vertices(f).begin(), pair.a.face_vertices(f).end());
    const Separation u =
        cold_start({std::move(turned), faces}, pair.b,
                   placed_at(turn * pair.a_from_b.position, turn * pair.a_from_b.orientation));
    RC_ASSERT(std::abs(s.distance - u.distance) <= 1e-10 * pair.size());
  }));
}

}  // namespace
}  // namespace offstage::sim
