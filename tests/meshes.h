#pragma once
/// Closed meshes of known solids, for tests.

#include <cmath>
#include <numbers>

#include "sim/geometry/mesh.h"

namespace offstage::sim {

inline TriangleMesh box_mesh(const Vec3& size) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.push_back(
        size.cwiseProduct(Vec3(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5)));
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

/// Returns a torus about Y with major radius R and tube radius r.
inline TriangleMesh torus_mesh(Real R, Real r, uint32_t around, uint32_t across) {
  constexpr Real kTurn = 2 * std::numbers::pi;
  TriangleMesh mesh;
  for (uint32_t i = 0; i < around; ++i)
    for (uint32_t j = 0; j < across; ++j) {
      const Real u = kTurn * i / around, v = kTurn * j / across, d = R + r * std::cos(v);
      mesh.vertices.emplace_back(d * std::cos(u), r * std::sin(v), -d * std::sin(u));
    }
  for (uint32_t i = 0; i < around; ++i)
    for (uint32_t j = 0; j < across; ++j) {
      const uint32_t i1 = (i + 1) % around, j1 = (j + 1) % across;
      mesh.triangles.push_back({i * across + j, i1 * across + j, i1 * across + j1});
      mesh.triangles.push_back({i * across + j, i1 * across + j1, i * across + j1});
    }
  return mesh;
}

inline TriangleMesh sphere_mesh(Real radius, uint32_t around, uint32_t rings) {
  constexpr Real kPi = std::numbers::pi;
  TriangleMesh mesh;
  mesh.vertices.emplace_back(0, radius, 0);
  for (uint32_t k = 1; k < rings; ++k)
    for (uint32_t i = 0; i < around; ++i) {
      const Real theta = kPi * k / rings, phi = 2 * kPi * i / around;
      mesh.vertices.push_back(
          radius * Vec3(std::sin(theta) * std::cos(phi), std::cos(theta), -std::sin(theta) * std::sin(phi)));
    }
  mesh.vertices.emplace_back(0, -radius, 0);
  const auto at = [&](uint32_t ring, uint32_t i) { return 1 + (ring - 1) * around + i % around; };
  const auto south = static_cast<uint32_t>(mesh.vertices.size() - 1);
  for (uint32_t i = 0; i < around; ++i) {
    mesh.triangles.push_back({0, at(1, i), at(1, i + 1)});
    mesh.triangles.push_back({south, at(rings - 1, i + 1), at(rings - 1, i)});
    for (uint32_t k = 1; k + 1 < rings; ++k) {
      mesh.triangles.push_back({at(k, i), at(k + 1, i), at(k + 1, i + 1)});
      mesh.triangles.push_back({at(k, i), at(k + 1, i + 1), at(k, i + 1)});
    }
  }
  return mesh;
}

}  // namespace offstage::sim
