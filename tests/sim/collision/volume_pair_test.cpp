#include "sim/collision/volume_pair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include <gtest/gtest.h>

#include "sim/geometry/closest_points.h"
#include "tests/meshes.h"
#include "tests/random.h"

namespace offstage::sim {
namespace {

struct Sample {
  uint64_t i;
  uint32_t used = 0;

  Real next() { return Scatter{11}.uniform(i, used++); }
  Vec3 vec() {
    const Real x = next(), y = next(), z = next();
    return {x - 0.5, y - 0.5, z - 0.5};
  }
  /// Returns half extents of a box, which may be flat, straight or a point.
  Vec3 half() {
    Vec3 h = vec() + Vec3::Constant(0.5);
    for (int k = 0; k < 3; ++k)
      if (next() < 0.15) h[k] = 0;
    return h;
  }
  /// Returns a rotation. Parallel axes are frequent, because the cross products of parallel edges are
  /// rounding noise.
  Quat turn() {
    const int kind = static_cast<int>(next() * 4);
    const Quat half_turns[] = {Quat::Identity(), Quat(std::sqrt(0.5), 0, std::sqrt(0.5), 0)};
    if (kind < 2) return half_turns[kind];
    if (kind == 2) return Quat(1, 1e-9 * next(), 0, 1e-8 * next()).normalized();
    return Quat(vec().x(), vec().x(), vec().x(), vec().x()).normalized();
  }

  template <class Volume>
  Volume volume() {
    const Vec3 centre = vec() * 2.5, h = half();
    if constexpr (std::is_same_v<Volume, Aabb>) return Aabb(centre - h, centre + h);
    if constexpr (std::is_same_v<Volume, Obb>) return {centre, h, turn().toRotationMatrix()};
    if constexpr (std::is_same_v<Volume, BoundingSphere>) return {centre, h[0]};
  }
};

/// The same volume as a solid for the reference: an oriented box with a radius around it, in A's frame.
struct Body {
  Obb box;
  Real radius = 0;
};
Body body(const Aabb& v) {
  return {{v.center(), v.sizes() / 2, Mat3::Identity()}};
}
Body body(const Obb& v) {
  return {v};
}
Body body(const BoundingSphere& v) {
  return {{v.centre, Vec3::Zero(), Mat3::Identity()}, v.radius};
}
Body placed(Body b, const Pose& pose) {
  b.box.centre = pose.point_to_world(b.box.centre);
  b.box.axes = pose.orientation.toRotationMatrix() * b.box.axes;
  return b;
}

std::vector<TriangleVertices> surface(const Obb& box) {
  const TriangleMesh mesh = box_mesh(2 * box.half);
  std::vector<TriangleVertices> triangles;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto at = [&](uint32_t v) { return Vec3(box.centre + box.axes * mesh.vertices[v]); };
    triangles.push_back({at(a), at(b), at(c)});
  }
  return triangles;
}

bool inside(const Obb& box, const Vec3& p) {
  return ((box.axes.transpose() * (p - box.centre)).cwiseAbs().array() <= box.half.array()).all();
}

/// Returns the distance of two boxes, by all pairs of triangles of their surfaces.
Real true_distance(const Body& a, const Body& b) {
  Real d2 = inside(a.box, b.box.centre) || inside(b.box, a.box.centre) ? 0 : 1e30;
  const auto surface_b = surface(b.box);
  for (const TriangleVertices& s : surface(a.box))
    for (const TriangleVertices& t : surface_b)
      if (d2 > 0) d2 = std::min(d2, closest_on_triangles(s, t).squared_distance);
  return std::sqrt(d2) - a.radius - b.radius;
}

template <class Pair>
class VolumePair : public testing::Test {};
template <class A, class B>
struct Kinds {};
using AllKinds =
    testing::Types<Kinds<Aabb, Aabb>, Kinds<Aabb, Obb>, Kinds<Aabb, BoundingSphere>, Kinds<Obb, Aabb>,
                   Kinds<Obb, Obb>, Kinds<Obb, BoundingSphere>, Kinds<BoundingSphere, Aabb>,
                   Kinds<BoundingSphere, Obb>, Kinds<BoundingSphere, BoundingSphere>>;
TYPED_TEST_SUITE(VolumePair, AllKinds);

template <class A, class B>
void compare(Kinds<A, B>) {
  int touching = 0;
  for (uint64_t i = 0; i < 400; ++i) {
    Sample sample{i};
    const A a = sample.volume<A>();
    const B b = sample.volume<B>();
    const Pose a_from_b{sample.vec(), sample.turn()};
    const Placement place(a_from_b, 10, 0);
    const Real d = true_distance(body(a), placed(body(b), a_from_b));
    touching += d <= 0;
    ASSERT_TRUE(std::abs(d) < 1e-9 || overlap(a, b, place) == (d < 0)) << i << ": " << d;
    ASSERT_LE(gap(a, b, place), std::max(d, 0.0) + 1e-12) << i;
    if (d <= 0) continue;
    ASSERT_TRUE(overlap(a, b, Placement(a_from_b, 10, d))) << i;
    ASSERT_FALSE(overlap(a, b, Placement(a_from_b, 10, 0.2 * d)))
        << i << ": the margin is no more than needed";
    if constexpr (kIsSphere<A> || kIsSphere<B>) {
      ASSERT_NEAR(gap(a, b, place), d, 1e-12) << i;
    }
  }
  EXPECT_GT(touching, 40);
  EXPECT_LT(touching, 360);
}

TYPED_TEST(VolumePair, OverlapsIfTheDistanceOfTheirSurfacesIsZero) {
  compare(TypeParam());
}

// Two unit cubes whose faces, edges or corners just touch, or are apart by slightly more than rounding.
TYPED_TEST(VolumePair, TouchingCounts) {
  const auto expect = [](auto a, auto b) {
    for (Vec3 direction : {Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(1, 1, 0), Vec3(1, -1, 1)})
      for (const Quat& turn : {Quat::Identity(), Quat(std::sqrt(0.5), 0, std::sqrt(0.5), 0)}) {
        const bool spheres = kIsSphere<decltype(a)> || kIsSphere<decltype(b)>;
        const Vec3 offset = spheres ? Vec3(direction * (direction.x() != 0)) : direction;
        if (spheres && offset.squaredNorm() != 1) continue;
        EXPECT_TRUE(overlap(a, b, Placement({offset, turn}, 2, 0)));
        EXPECT_FALSE(overlap(a, b, Placement({offset * (1 + 1e-12), turn}, 2, 0)));
      }
  };
  const auto volumes = std::tuple(Aabb(Vec3::Constant(-0.5), Vec3::Constant(0.5)),
                                  Obb{Vec3::Zero(), Vec3::Constant(0.5)}, BoundingSphere{Vec3::Zero(), 0.5});
  [&]<class A, class B>(Kinds<A, B>) { expect(std::get<A>(volumes), std::get<B>(volumes)); }(TypeParam());
}

}  // namespace
}  // namespace offstage::sim
