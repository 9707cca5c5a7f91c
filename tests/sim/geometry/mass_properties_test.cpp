#include "sim/geometry/mass_properties.h"

#include <gtest/gtest.h>

#include "tests/meshes.h"

namespace offstage::sim {
namespace {

TriangleMesh placed(TriangleMesh mesh, const Pose& pose) {
  for (Vec3& v : mesh.vertices) v = pose.point_to_world(v);
  return mesh;
}

TEST(MassProperties, BoxMeshEqualsTheClosedFormWhereverItIs) {
  const Vec3 size(0.3, 1.1, 2);
  const MassProperties exact = mass_properties(Shape(Box{size}));
  const Pose pose{Vec3(40, -30, 70), Quat(Eigen::AngleAxisd(1.1, Vec3(1, 2, 3).normalized()))};
  const MassProperties m = mass_properties(placed(box_mesh(size), pose));
  const Mat3 R = pose.orientation.toRotationMatrix();
  EXPECT_NEAR(m.volume, exact.volume, 1e-12);
  EXPECT_NEAR((m.centre - pose.position).norm(), 0, 1e-12);
  EXPECT_NEAR((m.inertia - R * exact.inertia * R.transpose()).norm(), 0, 1e-12);
}

// For vertices at 0 and at the unit vectors: volume 1/6, centre (1/4, 1/4, 1/4), int x^2 = 1/60, int xy =
// 1/120.
TEST(MassProperties, CornerTetrahedron) {
  const TriangleMesh mesh = {{Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()},
                             {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
  const MassProperties m = mass_properties(mesh);
  EXPECT_NEAR(m.volume, 1.0 / 6, 1e-15);
  EXPECT_NEAR((m.centre - Vec3::Constant(0.25)).norm(), 0, 1e-15);
  const Real diagonal = 2.0 / 60 - 2.0 / 16 / 6, off = -(1.0 / 120 - 1.0 / 16 / 6);
  EXPECT_NEAR((m.inertia.diagonal() - Vec3::Constant(diagonal)).norm(), 0, 1e-15);
  EXPECT_NEAR(m.inertia(0, 1), off, 1e-15);
  EXPECT_NEAR(m.inertia(1, 2), off, 1e-15);
}

// Compares the closed forms of the primitives with fine meshes of the same solids.
TEST(MassProperties, ClosedFormsOfPrimitivesAgreeWithMeshes) {
  // the profile goes from the top pole to the bottom pole
  const auto revolution = [](const std::vector<Eigen::Vector2d>& profile) {
    constexpr uint32_t kAround = 400;
    TriangleMesh mesh;
    for (const auto& p : profile)
      for (uint32_t i = 0; i < kAround; ++i) {
        const Real phi = 2 * std::numbers::pi * i / kAround;
        mesh.vertices.emplace_back(p.x() * std::cos(phi), p.y(), -p.x() * std::sin(phi));
      }
    for (uint32_t k = 0; k + 1 < profile.size(); ++k)
      for (uint32_t i = 0; i < kAround; ++i) {
        const uint32_t j = (i + 1) % kAround, a = k * kAround, b = a + kAround;
        mesh.triangles.push_back({a + i, b + i, b + j});
        mesh.triangles.push_back({a + i, b + j, a + j});
      }
    return weld(mesh);
  };
  const auto expect_equal = [](const MassProperties& a, const MassProperties& b) {
    EXPECT_NEAR(a.volume / b.volume, 1, 2e-4);
    EXPECT_NEAR((a.centre - b.centre).norm(), 0, 1e-6);
    EXPECT_NEAR((a.inertia - b.inertia).norm() / b.inertia.norm(), 0, 3e-4);
  };
  expect_equal(mass_properties(revolution({{0, 0.6}, {0.4, 0.6}, {0.4, -0.6}, {0, -0.6}})),
               mass_properties(Shape(Cylinder{0.4, 1.2})));
  expect_equal(mass_properties(revolution({{0, 0.6}, {0.4, -0.6}, {0, -0.6}})),
               mass_properties(Shape(Cone{0.4, 1.2})));
  std::vector<Eigen::Vector2d> capsule;
  for (int half = 0; half < 2; ++half)
    for (int k = 0; k <= 100; ++k) {
      const Real theta = std::numbers::pi / 2 * (half + k / 100.0);
      capsule.emplace_back(0.3 * std::sin(theta), 0.3 * std::cos(theta) + (half == 0 ? 0.5 : -0.5));
    }
  expect_equal(mass_properties(revolution(capsule)), mass_properties(Shape(Capsule{0.3, 1.0})));
}

TEST(PrincipalInertia, RebuildsTheTensorFromARightHandedFrame) {
  Mat3 inertia;
  inertia << 3, 0.4, -0.2, 0.4, 2, 0.7, -0.2, 0.7, 4;
  const PrincipalInertia p = diagonalise(inertia);
  const Mat3 R = p.orientation.toRotationMatrix();
  EXPECT_NEAR(R.determinant(), 1, 1e-14);
  EXPECT_NEAR((R * p.moments.asDiagonal() * R.transpose() - inertia).norm(), 0, 1e-14);
  EXPECT_LE(p.moments[0], p.moments[1]);
  EXPECT_LE(p.moments[1], p.moments[2]);
}

}  // namespace
}  // namespace offstage::sim
