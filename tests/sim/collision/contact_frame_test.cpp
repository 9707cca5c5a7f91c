#include "sim/collision/contact_frame.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sim/collision/gjk.h"
#include "sim/collision/vclip.h"
#include "sim/core/rotation.h"
#include "tests/convex_samples.h"

namespace offstage::sim {
namespace {

const Vec3 kOrigin = Vec3::Zero();

Mat3 matrix(const ContactFrame& f) {
  Mat3 m;
  m << f.n, f.t, f.k;
  return m;
}

TEST(ContactFrame, IsRightHandedAndOrthonormalForEveryNormal) {
  Dice dice(1);
  for (int k = 0; k < 1000; ++k) {
    const Vec3 n = k < 6 ? Vec3((k % 2 ? 1 : -1) * Vec3::Unit(k / 2)) : dice.direction();
    const Mat3 m = matrix(contact_frame(n));
    ASSERT_LT((m.transpose() * m - Mat3::Identity()).norm(), 1e-14);
    ASSERT_NEAR(m.determinant(), 1, 1e-14);
    ASSERT_EQ(m.col(0), n);
  }
}

// n rotates with angular velocity w. The central difference has an error of at most w^3 h^2 / 6, and rounding
// / h.
TEST(ContactFrame, RateIsTheDerivative) {
  Dice dice(2);
  constexpr Real h = 1e-5;
  for (int k = 0; k < 1000; ++k) {
    const Vec3 n = dice.direction(), w = dice.direction();
    const auto at = [&](Real t) { return contact_frame(Quat(Eigen::AngleAxisd(t, w)) * n); };
    const Vec3 size = n.cwiseAbs();
    const Real second = size.sum() - size.minCoeff() - size.maxCoeff();
    // Skipped: another component becomes the smallest within h.
    if (second - size.minCoeff() < 10 * h) continue;
    const ContactFrame rate = contact_frame_rate(contact_frame(n), w.cross(n));
    const Mat3 difference = (matrix(at(h)) - matrix(at(-h))) / (2 * h);
    ASSERT_LT((matrix(rate) - difference).norm(), 1e-9);
    const Mat3 spin = matrix(rate) * matrix(contact_frame(n)).transpose();
    ASSERT_LT((spin + spin.transpose()).norm(), 1e-13);
  }
}

/// Two solids whose velocities are given about the world's origin.
struct Pair {
  std::string name;
  Convex a, b;
  Pose world_from_a, world_from_b;
  NormalSource source;
};

Pose moved(const Pose& p, const Twist& motion, Real t) {
  const Real angle = motion.angular_velocity.norm() * t;
  const Quat turn(Eigen::AngleAxisd(angle, motion.angular_velocity.normalized()));
  return {turn * p.position + t * motion.velocity, turn * p.orientation};
}

Pose relative(const Pose& a, const Pose& b) {
  return {a.point_to_body(b.position), a.orientation.conjugate() * b.orientation};
}

Separation separation(const Pair& pair, const Pose& a, const Pose& b) {
  if (pair.a.polyhedron && pair.b.polyhedron) {
    VclipCache fresh;
    return vclip(*pair.a.polyhedron, *pair.b.polyhedron, relative(a, b), fresh);
  }
  GjkCache fresh;
  return gjk(pair.a, pair.b, relative(a, b), fresh);
}

/// Returns the central difference of the normal over a time step. It is computed only from the geometry.
Vec3 difference(const Pair& pair, const Twist& a, const Twist& b, Real h) {
  const auto normal = [&](Real t) {
    const Pose at = moved(pair.world_from_a, a, t);
    return at.vector_to_world(separation(pair, at, moved(pair.world_from_b, b, t)).normal);
  };
  return (normal(h) - normal(-h)) / (2 * h);
}

Vec3 rate(const Pair& pair, const Twist& a, const Twist& b) {
  const Separation s = separation(pair, pair.world_from_a, pair.world_from_b);
  const Manifold m = placed(
      manifold(pair.a, pair.b, relative(pair.world_from_a, pair.world_from_b), s, std::max(0.0, s.distance)),
      pair.world_from_a);
  EXPECT_EQ(m.source, pair.source) << pair.name;
  EXPECT_EQ(m.count, 1u) << pair.name;
  return normal_rate(m, m.points[0], a, b);
}

Pose at(const Vec3& p, const Quat& q = Quat::Identity()) {
  return {p, q};
}
Quat turn(Real x, Real y, Real z) {
  return Quat(Eigen::AngleAxisd(x, Vec3::UnitX()) * Eigen::AngleAxisd(y, Vec3::UnitY()) *
              Eigen::AngleAxisd(z, Vec3::UnitZ()));
}

std::vector<Pair> pairs() {
  static const ConvexPolyhedron cube = box_polyhedron(Vec3::Ones());
  const Convex box = convex(cube), ball = convex(Sphere{0.3}), capsule = convex(Capsule{0.2, 1}),
               cylinder = convex(Cylinder{0.4, 1}), cone = convex(Cone{0.5, 1});
  const Quat tip = rotation_between(Vec3::Ones(), Vec3(0.1, 1, 0.05));
  const Quat away = rotation_between(Vec3::Ones(), -Vec3::Ones());
  const Real corner = std::sqrt(0.75);
  return {
      {"vertex on face", box, box,
       at({0, 0.52 + corner, 0}, rotation_between(Vec3::Ones(), Vec3(0.1, -1, 0.05))), at(kOrigin),
       NormalSource::face_of_b},
      {"face on vertex", box, box, at(kOrigin), at({0.1, 0.53 + corner, 0}, tip), NormalSource::face_of_a},
      {"edge across edge", box, box, at({0, 1.5, 0}, turn(std::numbers::pi / 4, 0, 0.1)),
       at(kOrigin, turn(0, 0.1, std::numbers::pi / 4)), NormalSource::edges},
      {"vertex on vertex", box, box, at({0.9, 0.93, 0.96}), at({-0.2, -0.2, -0.2}, away),
       NormalSource::points},
      {"vertex by edge", box, box, at(kOrigin),
       at({1.2, 0, 1.23}, rotation_between(Vec3::Ones(), Vec3(-1, 0.2, -1.1))), NormalSource::edge_of_a},
      {"edge by vertex", box, box, at({1.2, 0, 1.23}, rotation_between(Vec3::Ones(), Vec3(-1, 0.2, -1.1))),
       at(kOrigin), NormalSource::edge_of_b},
      {"ball on ball", ball, ball, at({0.3, 0.5, 0.1}), at(kOrigin), NormalSource::points},
      {"ball on face", ball, box, at({0.3, 0.79, 0.1}), at(kOrigin), NormalSource::face_of_b},
      {"ball by edge", ball, box, at({0.6, 0.7, 0.1}), at(kOrigin), NormalSource::edge_of_b},
      {"ball by a capsule's side", ball, capsule, at({0.4, 0.1, 0.3}), at(kOrigin), NormalSource::edge_of_b},
      {"ball by a cylinder's side", cylinder, ball, at(kOrigin), at({0.4, 0.1, 0.6}),
       NormalSource::edge_of_a},
      {"ball by a cone's side", cone, ball, at(kOrigin), at({0.3, 0.2, 0.5}), NormalSource::edge_of_a},
      {"ball by a cone's tip", cone, ball, at(kOrigin), at({0.1, 0.9, 0.05}), NormalSource::points},
      {"capsules across", capsule, capsule, at({0, 0, 0.41}, turn(0, 0, 0.8)), at(kOrigin),
       NormalSource::edges},
      {"cylinders across", cylinder, cylinder, at({0, 0, 0.81}, turn(0, 0, 0.8)), at(kOrigin),
       NormalSource::edges},
      {"a cylinder across an edge", cylinder, box, at({0, 1.16, 0}, turn(0, 0, std::numbers::pi / 2 - 0.2)),
       at(kOrigin, turn(0, 0.5, 0) * turn(std::numbers::pi / 4, 0, 0)), NormalSource::edges},
      {"overlapping capsules", capsule, capsule, at({0, 0, 0.38}, turn(0, 0, 0.8)), at(kOrigin),
       NormalSource::edges},
      {"overlapping balls", ball, ball, at({0.3, 0.45, 0.1}), at(kOrigin), NormalSource::points},
  };
}

// The analytic rate of each normal equals the rate found from the closest points of the moving solids.
// Closest points of curved shapes are accurate to about 1e-9, those of polyhedra and spheres to rounding.
TEST(NormalRate, IsTheDerivativeOfTheGeometryForEverySource) {
  constexpr Real h = 1e-3;
  Dice dice(4);
  for (const Pair& pair : pairs())
    for (int k = 0; k < 10; ++k) {
      const Twist a{dice.direction(), dice.direction()}, b{dice.direction(), dice.direction()};
      const Vec3 expected = (4 * difference(pair, a, b, h / 2) - difference(pair, a, b, h)) / 3;
      const Vec3 n = rate(pair, a, b);
      ASSERT_LT((n - expected).norm(), 2e-5 * (1 + n.norm()))
          << pair.name << ": " << n.transpose() << " is not " << expected.transpose();
    }
}

TEST(NormalRate, OfPolyhedraDiffersFromCentralDifferencesByTheSquareOfTheStep) {
  Dice dice(5);
  for (const Pair& pair : pairs()) {
    if (!pair.a.polyhedron || !pair.b.polyhedron) continue;
    const Twist a{dice.direction(), dice.direction()}, b{dice.direction(), dice.direction()};
    const Vec3 n = rate(pair, a, b);
    const Real coarse = (difference(pair, a, b, 4e-3) - n).norm(),
               fine = (difference(pair, a, b, 2e-3) - n).norm();
    ASSERT_NEAR(std::log2(coarse / fine), 2, 0.1) << pair.name;
  }
}

TEST(NormalRate, OfAPointOnAPointIsFinite) {
  Manifold m;
  m.count = 1;
  m.points[0] = {Vec3::Zero(), Vec3::Zero(), 0, 0};
  const Vec3 n = normal_rate(m, m.points[0], {Vec3::UnitX(), Vec3::UnitZ()}, {Vec3::UnitZ(), Vec3::UnitX()});
  EXPECT_LT((n - Vec3(-0.5, 0, 0.5)).norm(), 1e-15);
}

}  // namespace
}  // namespace offstage::sim
