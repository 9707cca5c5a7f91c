#include "sim/collision/gjk.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "convex_samples.h"

namespace offstage::sim {
namespace {

constexpr Real kExact = 1e-14;

Quat turned(Real degrees, const Vec3& axis) {
  return Quat(Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis.normalized()));
}

Pose inverse_of(const Pose& p) {
  return {p.vector_to_body(-p.position), p.orientation.conjugate()};
}

Pose operator*(const Pose& p, const Pose& q) {
  return {p.point_to_world(q.position), p.orientation * q.orientation};
}

Separation cold(const Convex& a, const Convex& b, const Pose& pose) {
  GjkCache cache;
  return gjk(a, b, pose, cache);
}

Separation cold(const Shape& a, const Shape& b, const Pose& pose) {
  return cold(convex(a), convex(b), pose);
}

void expect_answer(const Separation& s, Real distance, const Vec3& normal) {
  EXPECT_TRUE(s.converged);
  EXPECT_NEAR(s.distance, distance, kExact);
  EXPECT_LT((s.normal - normal).norm(), 1e-12) << s.normal.transpose();
  EXPECT_LT((s.on_a - s.on_b - s.distance * s.normal).norm(), kExact);
}

TEST(Gjk, KnowsSimpleCasesInClosedForm) {
  const Real sqrt2 = std::sqrt(2.0);
  // Two spheres; two boxes face to face, one of them rotated; two boxes edge to edge.
  expect_answer(cold(Sphere{1}, Sphere{0.5}, {{0, 3, 0}, Quat::Identity()}), 1.5, {0, -1, 0});
  expect_answer(cold(Box{{2, 2, 2}}, Box{{2, 2, 2}}, {{0, 3, 0.2}, turned(30, {0, 1, 0})}), 1, {0, -1, 0});
  expect_answer(
      cold(Box{{2, 2, 2}}, Box{{2, 2, 2}}, {{0, 3.2, 0}, turned(90, {0, 1, 0}) * turned(45, {1, 0, 0})}),
      2.2 - sqrt2, {0, -1, 0});
  // The apex of a cone above a box, the rim of a tilted cylinder above a box, and crossed capsules.
  expect_answer(cold(Box{{2, 2, 2}}, Cone{0.5, 1}, {{0.3, 2, 0.2}, turned(180, {1, 0, 0})}), 0.5, {0, -1, 0});
  expect_answer(cold(Box{{4, 2, 4}}, Cylinder{1, 2}, {{0, 3, 0}, turned(45, {0, 0, 1})}), 2 - sqrt2,
                {0, -1, 0});
  expect_answer(cold(Capsule{0.2, 2}, Capsule{0.3, 2}, {{0, 0, 1}, turned(90, {0, 0, 1})}), 0.5, {0, 0, -1});
}

TEST(Gjk, KnowsDepthsInClosedForm) {
  expect_answer(cold(Sphere{1}, Sphere{0.5}, {{0, 1, 0}, Quat::Identity()}), -0.5, {0, -1, 0});
  expect_answer(cold(Box{{2, 2, 2}}, Sphere{0.5}, {{0, 0.7, 0.1}, Quat::Identity()}), -0.8, {0, -1, 0});
  expect_answer(cold(Box{{2, 2, 2}}, Box{{2, 2, 2}}, {{0.1, 1.8, 0.2}, turned(30, {0, 1, 0})}), -0.2,
                {0, -1, 0});
  expect_answer(cold(Box{{2, 2, 2}}, Capsule{0.3, 2}, {{0.9, 0, 0}, turned(90, {1, 0, 0})}), -0.4,
                {-1, 0, 0});
  expect_answer(cold(Cylinder{1, 2}, Box{{1, 1, 1}}, {{0.2, 1.4, 0}, turned(20, {0, 1, 0})}), -0.1,
                {0, -1, 0});
}

TEST(Gjk, CrossedCapsulesPartAcrossBothAxes) {
  const Separation s = cold(Capsule{0.2, 2}, Capsule{0.3, 2}, {{0, 0.5, 0}, turned(90, {1, 0, 0})});
  expect_answer(s, -0.5, s.normal.x() > 0 ? Vec3(1, 0, 0) : Vec3(-1, 0, 0));
}

// The separation of a resting contact changes sign often: neither the distance nor the normal may jump there.
// The depth of a curved core is accurate to 1e-10 of its size, so the normal is accurate to the square root
// of that.
TEST(Gjk, CrossesTouchingSmoothly) {
  const ConvexPolyhedron hull = box_polyhedron({1, 1, 1});
  struct Rest {
    Convex a, b;
    Quat rotation;
    Real height;  // height of B's centre when the solids touch
    bool curved;
  };
  const std::vector<Rest> rests = {
      {convex(Shape(Box{{2, 1, 2}})), convex(Shape(Box{{1, 1, 1}})), Quat::Identity(), 1, false},
      {convex(Shape(Box{{2, 1, 2}})), convex(Shape(Box{{1, 1, 1}})), turned(31, {0, 1, 0}), 1, false},
      {convex(hull), convex(hull), turned(90, {0, 1, 0}), 1, false},
      {convex(Shape(Box{{2, 1, 2}})), convex(Shape(Cylinder{0.5, 1})), Quat::Identity(), 1, true},
      {convex(Shape(Box{{2, 1, 2}})), convex(Shape(Cone{0.5, 1})), Quat::Identity(), 1, true},
      {convex(Shape(Box{{2, 1, 2}})), convex(Shape(Cylinder{0.5, 1})), turned(90, {1, 0, 1}), 1, true},
      {convex(Shape(Box{{2, 1, 2}})), convex(Shape(Capsule{0.5, 1})), turned(90, {1, 0, 1}), 1, false},
      {convex(Shape(Box{{2, 1, 2}})), convex(Shape(Sphere{0.5})), Quat::Identity(), 1, false},
  };
  const auto expect_rest = [](const Rest& rest, const Vec3& sideways, Real gap, GjkCache& warm) {
    const Pose pose{Vec3(0, rest.height + gap, 0) + sideways, rest.rotation};
    for (const Separation& s : {cold(rest.a, rest.b, pose), gjk(rest.a, rest.b, pose, warm)}) {
      EXPECT_NEAR(s.distance, gap, rest.curved ? 1e-9 : kExact) << gap;
      EXPECT_LT((s.normal + Vec3::UnitY()).norm(), rest.curved ? 3e-5 : 1e-12)
          << gap << " gives " << s.normal.transpose();
      EXPECT_TRUE(s.converged);
    }
  };
  for (const Rest& rest : rests)
    for (const Vec3& sideways : {Vec3(0, 0, 0), Vec3(0.1, 0, 0.05), Vec3(0.25, 0, 0.25)}) {
      GjkCache warm;
      for (const Real size : {1e-3, 1e-6, 1e-9, 1e-11, 1e-13, 1e-14, 1e-15, 1e-16, 0.0})
        for (const Real gap : {size, -size}) expect_rest(rest, sideways, gap, warm);
    }
}

TEST(Gjk, DegenerateSolidsHaveFiniteAnswers) {
  const ConvexPolyhedron point({Vec3(1, 2, 3)}, {}), segment({Vec3(0, 0, 0), Vec3(1, 0, 0)}, {});
  const ConvexPolyhedron square = convex_hull(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}});
  const ConvexPolyhedron box = box_polyhedron({1, 1, 1});
  for (const ConvexPolyhedron* a : {&point, &segment, &square, &box})
    for (const ConvexPolyhedron* b : {&point, &segment, &square, &box})
      for (const Vec3& offset :
           {Vec3(0, 0, 0), Vec3(0.5, 0, 0), Vec3(0, 0.5, 0), Vec3(1, 0, 0), Vec3(0, 0, 1)}) {
        const Separation s = cold(convex(*a), convex(*b), {offset, Quat::Identity()});
        EXPECT_NEAR(s.distance, brute_force_separation(*a, *b, {offset, Quat::Identity()}).distance, 1e-12);
        EXPECT_NEAR(s.normal.norm(), 1, 1e-12);
        EXPECT_TRUE(s.on_a.allFinite() && s.on_b.allFinite() && s.converged);
      }
}

TEST(Gjk, WarmStartsChangeNothingButTheEffort) {
  Dice dice(4);
  int warm_iterations = 0, cold_iterations = 0;
  for (int i = 0; i < 60; ++i) {
    const ConvexPair pair = random_pair(dice, 60);
    const Convex a = convex(pair.a), b = convex(pair.b);
    Pose pose = pair.a_from_b;
    const Vec3 drift = 0.002 * pair.size() * dice.direction();
    const Quat turn(Eigen::AngleAxisd(0.005, dice.direction()));
    GjkCache cache;
    cache.size = 3;  // arbitrary contents, as another pair may have left them
    cache.from = {{{1000, 3}, {2, 2}, {0, 77}, {0, 0}}};
    cache.direction = dice.direction();
    for (int k = 0; k < 100; ++k) {
      const Separation warm = gjk(a, b, pose, cache), exact = cold(a, b, pose);
      const Real size = pair.size() + pose.position.norm();
      ASSERT_NEAR(warm.distance, exact.distance, 1e-11 * size);
      warm_iterations += warm.iterations;
      cold_iterations += exact.iterations;
      pose.position += drift;
      pose.orientation = (turn * pose.orientation).normalized();
    }
  }
  EXPECT_LT(warm_iterations, cold_iterations / 2);
}

TEST(Gjk, OverlapIsTheSignOfTheDistance) {
  Dice dice(5);
  for (int i = 0; i < 1000; ++i) {
    const ConvexPair pair = random_pair(dice, 30);
    const Real distance = pair.exact().distance, radius = i % 3 == 0 ? 0.1 * pair.size() : 0;
    if (std::abs(distance - radius) < 1e-12 * (pair.size() + pair.a_from_b.position.norm())) continue;
    const Convex a = convex(pair.a, radius), b = convex(pair.b);
    GjkCache cache;
    for (int k = 0; k < 2; ++k)  // cold start, then warm start
      ASSERT_EQ(overlap(a, b, pair.a_from_b, cache), distance < radius) << i << ": " << distance;
  }
}

/// Two random primitives in any relation: touching, apart, or penetrating deeply.
struct Placed {
  Shape a, b;
  Pose a_from_b;
};

Shape random_shape(Dice& dice, Real size) {
  const Real r = size * dice.uniform(0.1, 1), h = size * dice.uniform(0.1, 2);
  switch (dice.index(5)) {
    case 0:
      return Sphere{r};
    case 1:
      return Box{size * (Vec3::Constant(1.1) + dice.in_cube())};
    case 2:
      return Capsule{r, h};
    case 3:
      return Cylinder{r, h};
    default:
      return Cone{r, h};
  }
}

Placed random_primitives(uint64_t seed) {
  Dice dice(seed);
  const Real size = std::pow(10, dice.uniform(-3, 2));
  Placed p{random_shape(dice, size), random_shape(dice, size * dice.uniform(0.05, 1)), {}};
  const Real reach = convex(p.a).reach() + convex(p.b).reach();
  p.a_from_b = {dice.uniform(0, 1.5) * reach * dice.direction(), dice.rotation()};
  return p;
}

Real size_of(const Placed& p) {
  return convex(p.a).reach() + convex(p.b).reach() + p.a_from_b.position.norm();
}

/// Returns the support distance along `n`, including the radius.
Real height_along(const Convex& c, const Vec3& n) {
  uint32_t vertex = 0;
  return n.dot(c.support(n, vertex)) + c.radius;
}

/// Returns a lower bound of the distance, which is exact if n is the right normal.
Real separation_along(const Placed& p, const Vec3& n) {
  return -height_along(convex(p.a), -n) - height_along(convex(p.b), p.a_from_b.vector_to_body(n)) -
         n.dot(p.a_from_b.position);
}

TEST(GjkProperties, NormalsSupportTheDistanceOfPrimitives) {
  int unsure = 0;
  constexpr int kPairs = 3000;
  for (int i = 0; i < kPairs; ++i) {
    const Placed p = random_primitives(static_cast<uint64_t>(i));
    const Separation s = cold(p.a, p.b, p.a_from_b);
    unsure += !s.converged;
    ASSERT_NEAR(s.normal.norm(), 1, 1e-12);
    if (!s.converged) continue;
    ASSERT_NEAR(separation_along(p, s.normal), s.distance, 1e-9 * size_of(p)) << i;
  }
  EXPECT_LE(unsure, kPairs / 100);
}

TEST(GjkProperties, SwappingTheSolidsTurnsTheNormal) {
  EXPECT_TRUE(rc::check([](uint64_t seed) {
    const Placed p = random_primitives(seed);
    const Separation s = cold(p.a, p.b, p.a_from_b), t = cold(p.b, p.a, inverse_of(p.a_from_b));
    RC_ASSERT(std::abs(s.distance - t.distance) <= 2e-9 * size_of(p));
    // The normal of overlapping solids is not unique. For separate ones, an error e of the distance d turns
    // the normal by sqrt(2 e / d), and e is at most 1e-12 of the size.
    if (s.distance > 1e-3 * size_of(p))
      RC_ASSERT((p.a_from_b.vector_to_world(t.normal) + s.normal).norm() < 1e-4);
  }));
}

TEST(GjkProperties, RigidMotionsChangeNothing) {
  EXPECT_TRUE(rc::check([](uint64_t seed) {
    Dice dice(seed);
    const ConvexPair pair = random_pair(dice, 20);
    const Pose motion{pair.size() * dice.direction(), dice.rotation()};
    std::vector<Vec3> moved;
    for (const Vec3& v : pair.a.vertices()) moved.push_back(motion.point_to_world(v));
    const ConvexPolyhedron a = convex_hull(moved);
    const Separation s = cold(convex(pair.a), convex(pair.b), pair.a_from_b),
                     t = cold(convex(a), convex(pair.b), motion * pair.a_from_b);
    RC_ASSERT(std::abs(s.distance - t.distance) <= 1e-9 * (pair.size() + pair.a_from_b.position.norm()));
  }));
}

TEST(GjkProperties, NoPointsAreCloserThanTheDistance) {
  EXPECT_TRUE(rc::check([](uint64_t seed) {
    Dice dice(seed);
    const ConvexPair pair = random_pair(dice, 20);
    const Separation s = cold(convex(pair.a), convex(pair.b), pair.a_from_b);
    const auto inside = [&](const ConvexPolyhedron& p) {
      Vec3 x = p.centre();
      for (const Vec3& v : p.vertices()) x += dice.uniform(0, 0.3) * (v - x);
      return x;
    };
    for (int k = 0; k < 20; ++k) {
      const Vec3 between = inside(pair.a) - pair.a_from_b.point_to_world(inside(pair.b));
      RC_ASSERT(between.norm() >= s.distance - 1e-14 * (pair.size() + pair.a_from_b.position.norm()));
    }
  }));
}

// A translation by t changes a signed distance by at most |t|, including the transition from separation to
// overlap.
TEST(GjkProperties, DistanceIsLipschitzInTranslation) {
  EXPECT_TRUE(rc::check([](uint64_t seed) {
    Placed p = random_primitives(seed);
    Dice dice(seed ^ 0x5555);
    const Vec3 step = std::pow(10, dice.uniform(-12, 0)) * size_of(p) * dice.direction();
    const Real before = cold(p.a, p.b, p.a_from_b).distance;
    p.a_from_b.position += step;
    RC_ASSERT(std::abs(cold(p.a, p.b, p.a_from_b).distance - before) <= step.norm() + 2e-9 * size_of(p));
  }));
}

}  // namespace
}  // namespace offstage::sim
