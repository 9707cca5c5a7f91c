/// Distances and depths of convex polyhedra, compared with brute force, libccd and FCL.

#include <cmath>
#include <memory>

#include <ccd/ccd.h>
#include <fcl/fcl.h>
#include <gtest/gtest.h>

#include "convex_samples.h"
#include "sim/collision/gjk.h"

namespace offstage::sim {
namespace {

/// Returns the difference between a distance and the separation along its normal: zero if both are right.
Real normal_error(const ConvexPair& pair, const Separation& s) {
  Real low = 1e300, high = -1e300;
  for (const Vec3& v : pair.a.vertices()) low = std::min(low, s.normal.dot(v));
  for (const Vec3& v : pair.b.vertices())
    high = std::max(high, s.normal.dot(pair.a_from_b.point_to_world(v)));
  return std::abs(low - high - s.distance);
}

/// Returns the distance of a point outside a polyhedron; zero inside.
Real outside(const ConvexPolyhedron& p, const Vec3& point) {
  return std::max(0.0, brute_force_separation(p, ConvexPolyhedron({point}, {}), {}).distance);
}

void expect_brute_force(int pairs, uint32_t points, uint64_t seed) {
  Dice dice(seed);
  for (int i = 0; i < pairs; ++i) {
    const ConvexPair pair = random_pair(dice, points);
    const Separation exact = pair.exact();
    GjkCache cache;
    const Separation s = gjk(convex(pair.a), convex(pair.b), pair.a_from_b, cache);
    const Real tolerance = 1e-9 * (pair.size() + std::abs(exact.distance));
    ASSERT_NEAR(s.distance, exact.distance, tolerance) << "pair " << i;
    ASSERT_LE(normal_error(pair, s), tolerance) << "pair " << i;
    ASSERT_LE(outside(pair.a, s.on_a), tolerance) << "pair " << i;
    ASSERT_LE(outside(pair.b, pair.a_from_b.point_to_body(s.on_b)), tolerance) << "pair " << i;
    ASSERT_TRUE(s.converged) << "pair " << i;
  }
}

TEST(GjkDistance, OfRandomHullsIsThatOfBruteForce) {
  expect_brute_force(3000, 30, 11);
  expect_brute_force(100, 100, 12);
}

TEST(LongGjkDistance, OfManyRandomHullsIsThatOfBruteForce) {
  expect_brute_force(100'000, 30, 13);
  expect_brute_force(5000, 100, 14);
}

struct CcdHull {
  const ConvexPolyhedron* hull;
  Pose pose;
};

void ccd_support(const void* object, const ccd_vec3_t* direction, ccd_vec3_t* out) {
  const auto& h = *static_cast<const CcdHull*>(object);
  const Vec3 d = h.pose.vector_to_body({direction->v[0], direction->v[1], direction->v[2]});
  Vec3 best = h.hull->vertex(0);
  for (const Vec3& v : h.hull->vertices())
    if (d.dot(v) > d.dot(best)) best = v;
  const Vec3 w = h.pose.point_to_world(best);
  ccdVec3Set(out, w.x(), w.y(), w.z());
}

ConvexPair solid_pair(Dice& dice) {
  const auto hull = [&] {
    std::vector<Vec3> cloud;
    for (int k = 0; k < 20; ++k) cloud.push_back(dice.in_cube());
    return convex_hull(cloud);
  };
  return {hull(), hull(), {dice.uniform(0, 3) * dice.direction(), dice.rotation()}};
}

// libccd reports the depth of its polytope, whose expansion stops too early for a tenth of these pairs. For
// these, the depth differs from the overlap along its own direction and is not compared; the others must
// agree with ours.
TEST(GjkDistance, AgreesWithLibccd) {
  Dice dice(15);
  ccd_t ccd;
  CCD_INIT(&ccd);
  ccd.support1 = ccd.support2 = ccd_support;
  ccd.max_iterations = 500;
  ccd.epa_tolerance = 1e-9;
  int overlapping = 0, answered = 0;
  for (int i = 0; i < 1000; ++i) {
    const ConvexPair pair = solid_pair(dice);
    const CcdHull a{&pair.a, {}}, b{&pair.b, pair.a_from_b};
    GjkCache cache;
    const Separation s = gjk(convex(pair.a), convex(pair.b), pair.a_from_b, cache);
    if (std::abs(s.distance) < 1e-6) continue;
    ASSERT_EQ(ccdGJKIntersect(&a, &b, &ccd) != 0, s.distance < 0) << i;
    ccd_real_t depth = 0;
    ccd_vec3_t direction, position;
    if (ccdGJKPenetration(&a, &b, &ccd, &depth, &direction, &position) != 0) continue;
    ++overlapping;
    Separation theirs{.distance = -depth, .normal = -Vec3(direction.v[0], direction.v[1], direction.v[2])};
    if (normal_error(pair, theirs) > 1e-6) continue;
    ++answered;
    ASSERT_NEAR(depth, -s.distance, 2e-6) << i;
  }
  EXPECT_GT(answered, overlapping * 3 / 4);
}

std::shared_ptr<fcl::Convexd> fcl_convex(const ConvexPolyhedron& p) {
  const auto vertices =
      std::make_shared<std::vector<fcl::Vector3d>>(p.vertices().begin(), p.vertices().end());
  const auto faces = std::make_shared<std::vector<int>>();
  for (uint32_t f = 0; f < p.face_count(); ++f) {
    faces->push_back(static_cast<int>(p.face_vertices(f).size()));
    for (uint32_t v : p.face_vertices(f)) faces->push_back(static_cast<int>(v));
  }
  return std::make_shared<fcl::Convexd>(vertices, static_cast<int>(p.face_count()), faces);
}

TEST(GjkDistance, AgreesWithFcl) {
  Dice dice(16);
  for (int i = 0; i < 500; ++i) {
    const ConvexPair pair = solid_pair(dice);
    GjkCache cache;
    const Separation s = gjk(convex(pair.a), convex(pair.b), pair.a_from_b, cache);
    if (s.distance < 1e-3) continue;
    fcl::CollisionObjectd a(fcl_convex(pair.a)), b(fcl_convex(pair.b));
    b.setTransform(pair.a_from_b.orientation, pair.a_from_b.position);
    fcl::DistanceRequestd request;
    request.distance_tolerance = 1e-10;
    fcl::DistanceResultd result;
    ASSERT_NEAR(fcl::distance(&a, &b, request, result), s.distance, 1e-5) << i;
  }
}

}  // namespace
}  // namespace offstage::sim
