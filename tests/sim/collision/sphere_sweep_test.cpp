#include "sim/collision/sphere_sweep.h"

#include <gtest/gtest.h>

#include "sim/collision/distance.h"
#include "tests/meshes.h"
#include "tests/random.h"

namespace offstage::sim {
namespace {

/// Deterministic random vectors in a cube of side 2 s.
class Vectors {
 public:
  Vec3 operator()(Real s) {
    Vec3 v;
    for (int i = 0; i < 3; ++i) v[i] = s * (2 * random_.uniform(next_++, 0) - 1);
    return v;
  }

 private:
  Scatter random_{42};
  uint64_t next_ = 0;
};

const std::vector<Shape>& primitives() {
  static const std::vector<Shape> shapes = {Sphere{0.7},        Box{{1, 0.6, 1.4}}, Capsule{0.3, 0.9},
                                            Cylinder{0.5, 1.1}, Cone{0.6, 1.2},     Plane{}};
  return shapes;
}

TEST(Distance, GradientAndProjectionAreConsistentForEveryShape) {
  const CollisionMesh torus(torus_mesh(0.8, 0.3, 16, 12));
  const Shape mesh_shape = MeshShape{};
  std::vector<Solid> solids = {{&mesh_shape, &torus}};
  for (const Shape& s : primitives()) solids.push_back({&s, nullptr});
  Vectors random;
  for (const Solid& solid : solids)
    for (int k = 0; k < 500; ++k) {
      const Vec3 p = random(1.5);
      const SurfaceDistance d = signed_distance(solid, p);
      ASSERT_NEAR(d.normal.norm(), 1, 1e-12);
      const Vec3 foot = p - d.distance * d.normal;
      ASSERT_NEAR(signed_distance(solid, foot).distance, 0, 1e-9);
    }
}

TEST(Distance, MeshOfABoxHasTheDistanceOfTheBoxInsideAndOutside) {
  const CollisionMesh mesh(box_mesh(Vec3(1, 0.6, 1.4)));
  const Shape mesh_shape = MeshShape{};
  Vectors random;
  for (int k = 0; k < 5000; ++k) {
    const Vec3 p = random(1.2);
    ASSERT_NEAR(signed_distance(Solid{&mesh_shape, &mesh}, p).distance,
                signed_distance(Box{{1, 0.6, 1.4}}, p).distance, 1e-12);
  }
}

// The time at which the path enters a sphere whose radius is the sum of both radii.
TEST(Sweep, SphereAgainstSphereIsTheRootOfTheQuadratic) {
  const Shape shape = Sphere{0.7};
  Vectors random;
  int hits = 0;
  for (int k = 0; k < 5000; ++k) {
    const Vec3 a = 3 * random(1).normalized(), b = random(3), d = b - a;
    const Real A = d.squaredNorm(), B = a.dot(d), C = a.squaredNorm() - 0.81, disc = B * B - A * C;
    const Real root = disc > 0 ? (-B - std::sqrt(disc)) / A : -1;
    const auto hit = sweep_sphere({&shape, nullptr}, a, b, 0.2);
    ASSERT_EQ(hit.has_value(), root >= 0 && root <= 1) << "root " << root;
    if (!hit) continue;
    ++hits;
    ASSERT_NEAR(hit->fraction, root, 1e-6);
    ASSERT_NEAR(hit->distance, 0.2, 1e-11);
  }
  EXPECT_GT(hits, 300);
}

TEST(Sweep, FirstContactOfEveryShapeIsTouchingAndNothingBeforeIt) {
  const CollisionMesh torus(torus_mesh(0.8, 0.3, 16, 12));
  const Shape mesh_shape = MeshShape{};
  std::vector<Solid> solids = {{&mesh_shape, &torus}};
  for (const Shape& s : primitives()) solids.push_back({&s, nullptr});
  Vectors random;
  for (const Solid& solid : solids) {
    int hits = 0;
    for (int k = 0; k < 2000; ++k) {
      const Vec3 a = random(2), b = random(2);
      constexpr Real kRadius = 0.05;
      if (signed_distance(solid, a).distance <= kRadius) continue;
      const auto hit = sweep_sphere(solid, a, b, kRadius);
      const Real until = hit ? hit->fraction : 1;
      for (int i = 0; i <= 50; ++i)
        ASSERT_GT(signed_distance(solid, a + until * i / 50 * (b - a)).distance, kRadius - 1e-9);
      if (!hit) continue;
      ++hits;
      const SurfaceDistance at = signed_distance(solid, a + hit->fraction * (b - a));
      ASSERT_NEAR(at.distance, kRadius, 1e-9);
      ASSERT_LT(hit->normal.dot(b - a), 0);
    }
    EXPECT_GT(hits, 100);
  }
}

TEST(Sweep, ATouchingSphereHitsAtOnceWhenItApproachesAndNeverWhenItLeaves) {
  const Shape shape = Box{Vec3::Ones()};
  const Vec3 a(0, 0.6, 0);
  const auto hit = sweep_sphere({&shape, nullptr}, a, Vec3(0.2, 0.5, 0), 0.1);
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->fraction, 0);
  EXPECT_EQ(hit->normal, Vec3::UnitY());
  EXPECT_FALSE(sweep_sphere({&shape, nullptr}, a, Vec3(0.2, 0.7, 0), 0.1));
  EXPECT_FALSE(sweep_sphere({&shape, nullptr}, a, Vec3(0.2, 0.6, 0), 0.1));
}

}  // namespace
}  // namespace offstage::sim
