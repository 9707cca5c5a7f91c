// Solids of revolution, ellipsoids, concave shapes and compounds: mass by closed forms, closed meshes that
// their convex parts fill, and distances.

#include "sim/geometry/solid_mesh.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/collision/convex.h"
#include "sim/collision/distance.h"
#include "tests/random.h"

namespace offstage::sim {
namespace {

constexpr Real kPi = std::numbers::pi;

void expect_same(const MassProperties& m, const BodyMass& sum, Real rounding = 1e-12) {
  EXPECT_NEAR(m.volume / sum.mass, 1, rounding);
  EXPECT_LT((m.centre - sum.centre).norm(), rounding);
  EXPECT_LT((m.inertia - sum.inertia).norm(), rounding * sum.inertia.norm());
}

// A frustum is a cone without its tip, a tube a cylinder without a thinner one, an open box a box without its
// inside.
TEST(SolidMass, OfCutShapesIsThatOfTheWholeWithoutTheCut) {
  const Frustum frustum{0.6, 0.2, 0.8};
  const Real whole = 0.8 * 0.6 / 0.4, tip = whole - 0.8;  // heights of the cone and of its tip
  expect_same(
      mass_properties(Shape(frustum)),
      sum_of({{mass_properties(Shape(Cone{0.6, whole})), {Vec3(0, whole / 2 - 0.4, 0), Quat::Identity()}, 1},
              {mass_properties(Shape(Cone{0.2, tip})), {Vec3(0, 0.4 + tip / 2, 0), Quat::Identity()}, -1}}));
  expect_same(mass_properties(Tube{0.5, 0.7, 0.1}),
              sum_of({{mass_properties(Shape(Cylinder{0.5, 0.7})), {}, 1},
                      {mass_properties(Shape(Cylinder{0.4, 0.7})), {}, -1}}));
  expect_same(
      mass_properties(OpenBox{{0.6, 0.5, 0.8}, 0.05}),
      sum_of({{mass_properties(Shape(Box{{0.6, 0.5, 0.8}})), {}, 1},
              {mass_properties(Shape(Box{{0.5, 0.45, 0.7}})), {Vec3(0, 0.025, 0), Quat::Identity()}, -1}}));
}

// The moments of an ellipsoid are V/5 (b^2 + c^2). Pappus' theorem gives the volume of a torus. The moment of
// the torus about its axis is a sum over thin tubes around the axis.
TEST(SolidMass, OfAnEllipsoidAndATorus) {
  const MassProperties e = mass_properties(Shape(Ellipsoid{{0.3, 0.2, 0.1}}));
  EXPECT_NEAR(e.volume, 4.0 / 3 * kPi * 0.006, 1e-15);
  EXPECT_NEAR(e.inertia(1, 1), e.volume / 5 * (0.09 + 0.01), 1e-15);
  const Real R = 0.5, r = 0.2;
  constexpr int kSlices = 4000;
  std::vector<MassPart> slices;
  for (int k = 0; k < kSlices; ++k) {
    const Real h = 2 * r / kSlices, y = -r + (k + 0.5) * h, half = std::sqrt(r * r - y * y);
    slices.push_back({mass_properties(Tube{R + half, h, 2 * half}), {Vec3(0, y, 0), Quat::Identity()}, 1});
  }
  expect_same(mass_properties(Torus{R, r}), sum_of(slices), 1e-4);
}

// A hammer: a steel head of 4 kg on a wooden handle of 0.5 kg, by hand.
TEST(SolidMass, OfPartsIsTheSumByTheParallelAxisTheorem) {
  const BodyMass hammer =
      sum_of({{mass_properties(Shape(Box{{0.1, 0.05, 0.1}})), {Vec3(0, 0.3, 0), Quat::Identity()}, 8000},
              {mass_properties(Shape(Box{{0.02, 0.5, 0.02}})), {}, 2500}});
  EXPECT_NEAR(hammer.mass, 4.5, 1e-12);
  EXPECT_NEAR(hammer.centre.y(), 4 * 0.3 / 4.5, 1e-12);
  const Real head = 4 * (0.0025 + 0.01) / 12 + 4 * std::pow(0.3 - hammer.centre.y(), 2);
  const Real handle = 0.5 * (0.25 + 0.0004) / 12 + 0.5 * std::pow(hammer.centre.y(), 2);
  EXPECT_NEAR(hammer.inertia(0, 0), head + handle, 1e-12);
}

// The signed tetrahedra of a closed mesh and the volumes of convex parts that fill it without overlap agree;
// the volume of the inscribed mesh is less than that of the shape by the segments of its polygons.
TEST(SolidMeshes, AreClosedAndFilledByTheirParts) {
  const auto volume_of_parts = [](const SolidMesh& s) {
    Real sum = 0;
    for (const ConvexPolyhedron& part : s.parts) sum += mass_properties(part.triangles()).volume;
    return sum;
  };
  const auto check = [&](const SolidMesh& s, Real exact, Real missing) {
    const TriangleMesh welded = weld(s.mesh);
    const MeshTopology topology(welded);
    EXPECT_TRUE(topology.defects().closed()) << topology.defects().describe();
    EXPECT_FALSE(topology.defects().inverted);
    const Real volume = mass_properties(s.mesh).volume;
    EXPECT_NEAR(volume_of_parts(s) / volume, 1, 1e-3);  // the inner chords of a ring
    EXPECT_LE(volume, exact * (1 + 1e-12));
    EXPECT_GT(volume, exact * (1 - missing));
  };
  check(solid_mesh(Torus{0.5, 0.2}), mass_properties(Torus{0.5, 0.2}).volume, 0.02);
  check(solid_mesh(Tube{0.5, 0.7, 0.1}), mass_properties(Tube{0.5, 0.7, 0.1}).volume, 0.01);
  check(solid_mesh(OpenBox{{0.6, 0.5, 0.8}, 0.05}), mass_properties(OpenBox{{0.6, 0.5, 0.8}, 0.05}).volume,
        1e-9);
  for (const Shape& shape :
       {Shape(Sphere{0.3}), Shape(Capsule{0.2, 0.5}), Shape(Cylinder{0.2, 0.5}), Shape(Cone{0.3, 0.6}),
        Shape(Frustum{0.3, 0.1, 0.6}), Shape(Ellipsoid{{0.3, 0.2, 0.1}}), Shape(Box{{1, 2, 3}})})
    check(solid_mesh(shape), mass_properties(shape).volume, 0.03);
}

// The plane through the nearest surface point, with the gradient as its normal, supports the solid.
TEST(SolidDistance, OfRoundSolidsIsExactInsideAndOutside) {
  const Scatter random{7};
  uint64_t number = 0;
  const auto in_box = [&](Real half) {
    ++number;
    return Vec3(half * (2 * random.uniform(number, 0) - 1), half * (2 * random.uniform(number, 1) - 1),
                half * (2 * random.uniform(number, 2) - 1));
  };
  for (const Shape& shape : {Shape(Ellipsoid{{0.5, 0.2, 0.3}}), Shape(Ellipsoid{{0.3, 0.3, 0.1}}),
                             Shape(Frustum{0.4, 0.2, 0.5}), Shape(Frustum{0.2, 0.4, 0.5})})
    for (int i = 0; i < 400; ++i) {
      const Solid solid{&shape, nullptr};
      const Vec3 p = in_box(0.8);
      const SurfaceDistance d = signed_distance(solid, p);
      const Vec3 on_surface = p - d.distance * d.normal;
      EXPECT_NEAR(signed_distance(solid, on_surface).distance, 0, 1e-9);
      if (d.distance > 0) {
        EXPECT_NEAR(d.normal.dot(on_surface), support(solid, d.normal), 1e-9);
      }
      // No surface point is nearer: the distance changes by at most the displacement.
      const Vec3 q = p + in_box(0.05);
      EXPECT_LE(std::abs(signed_distance(solid, q).distance - d.distance), (q - p).norm() * (1 + 1e-9));
    }
}

// Points of the planes of symmetry, where two nearest points may exist, and the centre.
TEST(SolidDistance, OfAnEllipsoidInItsPlanesOfSymmetry) {
  const Ellipsoid e{{0.5, 0.2, 0.3}};
  EXPECT_NEAR(signed_distance(e, Vec3::Zero()).distance, -0.2, 1e-12);
  EXPECT_NEAR(signed_distance(e, Vec3(0.9, 0, 0)).distance, 0.4, 1e-12);
  EXPECT_NEAR(signed_distance(e, Vec3(0, 0.15, 0)).distance, -0.05, 1e-12);
  EXPECT_NEAR(signed_distance(e, Vec3(0.1, 0, 0)).distance, -std::sqrt(0.04 * (1 - 0.01 / (0.25 - 0.04))),
              1e-12);
}

}  // namespace
}  // namespace offstage::sim
