#include "sim/geometry/winding_number.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/meshes.h"
#include "tests/random.h"

namespace offstage::sim {
namespace {

Vec3 scattered(uint64_t i, Real half) {
  const Scatter random{3};
  return half *
         Vec3(2 * random.uniform(i, 0) - 1, 2 * random.uniform(i, 1) - 1, 2 * random.uniform(i, 2) - 1);
}

TEST(WindingNumber, IsOneInsideAndZeroOutsideOfClosedMeshes) {
  const Real R = 1, r = 0.4;
  const WindingNumber torus(torus_mesh(R, r, 90, 60));
  for (uint64_t i = 0; i < 2000; ++i) {
    const Vec3 p = scattered(i, 1.5);
    const Real height = std::hypot(std::hypot(p.x(), p.z()) - R, p.y()) - r;
    if (std::abs(height) < 0.01) continue;  // near the surface, the mesh differs from the torus
    ASSERT_NEAR(torus.at(p), height < 0 ? 1 : 0, 0.1) << p.transpose();
  }
}

// Seen from a point on its axis, a disc covers a spherical cap: a fraction (1 - cos) / 2 of the sphere.
TEST(WindingNumber, OfAnOpenSheetIsItsSolidAngle) {
  TriangleMesh disc;
  constexpr uint32_t kAround = 720;
  disc.vertices.emplace_back(0, 0, 0);
  for (uint32_t i = 0; i < kAround; ++i) {
    const Real phi = 2 * std::numbers::pi * i / kAround;
    disc.vertices.emplace_back(std::cos(phi), std::sin(phi), 0);
    disc.triangles.push_back({0, i + 1, (i + 1) % kAround + 1});
  }
  const WindingNumber winding(disc);
  for (Real z : {-0.001, -0.2, -1.0, -7.0, 0.3, 4.0}) {
    const Real cap = (1 - std::abs(z) / std::hypot(1, z)) / 2;
    EXPECT_NEAR(winding.at({0, 0, z}), z < 0 ? cap : -cap, 1e-2);
  }
}

TEST(WindingNumber, CountsCoversAndIsTurnedByFlippedFaces) {
  TriangleMesh twice = box_mesh(Vec3::Ones());
  const std::vector<Triangle> once = twice.triangles;
  twice.triangles.insert(twice.triangles.end(), once.begin(), once.end());
  EXPECT_NEAR(WindingNumber(twice).at({0.1, 0.2, -0.3}), 2, 1e-12);
  TriangleMesh inside_out = box_mesh(Vec3::Ones());
  for (Triangle& t : inside_out.triangles) std::swap(t[0], t[1]);
  EXPECT_NEAR(WindingNumber(inside_out).at({0.1, 0.2, -0.3}), -1, 1e-12);
  EXPECT_EQ(WindingNumber({}).at({1, 2, 3}), 0);
}

}  // namespace
}  // namespace offstage::sim
