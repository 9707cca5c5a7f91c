#pragma once
/// Closed meshes of non-convex solids, for tests of functions that accept any solid.

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <vector>

#include "sim/geometry/mesh.h"
#include "tests/random.h"

namespace offstage::sim {

/// Returns a solid made of unit cubes: cube (i, j, k) of a grid is a part of it if `filled(i, j, k)` is true.
/// The mesh has no faces between two cubes. The volume is the number of cubes.
template <class Filled>
TriangleMesh cubes(int nx, int ny, int nz, Filled&& filled) {
  const auto solid = [&](int i, int j, int k) {
    return i >= 0 && i < nx && j >= 0 && j < ny && k >= 0 && k < nz && filled(i, j, k);
  };
  TriangleMesh mesh;
  std::map<std::array<int, 3>, uint32_t> at;
  const auto vertex = [&](std::array<int, 3> c) {
    const auto [it, is_new] = at.try_emplace(c, static_cast<uint32_t>(mesh.vertices.size()));
    if (is_new) mesh.vertices.emplace_back(c[0], c[1], c[2]);
    return it->second;
  };
  for (int i = 0; i < nx; ++i)
    for (int j = 0; j < ny; ++j)
      for (int k = 0; k < nz; ++k) {
        if (!solid(i, j, k)) continue;
        for (std::size_t axis = 0; axis < 3; ++axis)
          for (int side : {0, 1}) {
            std::array<int, 3> beyond = {i, j, k};
            beyond[axis] += side == 1 ? 1 : -1;
            if (solid(beyond[0], beyond[1], beyond[2])) continue;
            std::array<uint32_t, 4> quad{};
            for (std::size_t c = 0; c < 4; ++c) {
              std::array<int, 3> corner = {i, j, k};
              corner[axis] += side;
              // The corners are counter-clockwise about the axis on the high side, and clockwise on the low
              // side.
              const std::size_t turn = side == 1 ? c : 3 - c;
              corner[(axis + 1) % 3] += turn == 1 || turn == 2;
              corner[(axis + 2) % 3] += turn >= 2;
              quad[c] = vertex(corner);
            }
            mesh.triangles.push_back({quad[0], quad[1], quad[2]});
            mesh.triangles.push_back({quad[0], quad[2], quad[3]});
          }
      }
  return mesh;
}

/// Returns a prism along z over a polygon that is star-shaped about its centre, given as (angle, radius)
/// pairs, counter-clockwise.
inline TriangleMesh star_shaped_prism(const std::vector<Eigen::Vector2d>& outline, Real height) {
  TriangleMesh mesh;
  const auto n = static_cast<uint32_t>(outline.size());
  for (Real z : {0.0, height})
    for (const auto& p : outline) mesh.vertices.emplace_back(p.x(), p.y(), z);
  mesh.vertices.emplace_back(0, 0, 0);
  mesh.vertices.emplace_back(0, 0, height);
  for (uint32_t i = 0; i < n; ++i) {
    const uint32_t j = (i + 1) % n;
    mesh.triangles.push_back({2 * n, j, i});
    mesh.triangles.push_back({2 * n + 1, n + i, n + j});
    mesh.triangles.push_back({i, j, n + j});
    mesh.triangles.push_back({i, n + j, n + i});
  }
  return mesh;
}

/// Returns a star with `points` tips at radius `outer` and inner corners at radius `inner`.
inline TriangleMesh star_prism(uint32_t points, Real outer, Real inner, Real height) {
  std::vector<Eigen::Vector2d> outline;
  for (uint32_t i = 0; i < 2 * points; ++i) {
    const Real phi = std::numbers::pi * i / points, r = i % 2 == 0 ? outer : inner;
    outline.emplace_back(r * std::cos(phi), r * std::sin(phi));
  }
  return star_shaped_prism(outline, height);
}

/// Returns the solid of revolution of a closed profile about the y axis. The points of the profile are
/// (radius, height), counter-clockwise if the radius axis points to the right. Points on the axis become
/// poles.
inline TriangleMesh lathe(const std::vector<Eigen::Vector2d>& profile, uint32_t around) {
  TriangleMesh soup;
  const auto n = static_cast<uint32_t>(profile.size());
  for (const auto& p : profile)
    for (uint32_t i = 0; i < around; ++i) {
      const Real phi = 2 * std::numbers::pi * i / around;
      soup.vertices.emplace_back(p.x() * std::cos(phi), p.y(), -p.x() * std::sin(phi));
    }
  for (uint32_t k = 0; k < n; ++k)
    for (uint32_t i = 0; i < around; ++i) {
      const uint32_t j = (i + 1) % around, a = k * around, b = (k + 1) % n * around;
      soup.triangles.push_back({a + i, a + j, b + j});
      soup.triangles.push_back({a + i, b + j, b + i});
    }
  return weld(soup);
}

inline TriangleMesh l_solid() {
  return cubes(2, 2, 1, [](int i, int j, int) { return i == 0 || j == 0; });
}
inline TriangleMesh u_solid() {
  return cubes(3, 3, 1, [](int i, int j, int) { return i != 1 || j == 0; });
}
inline TriangleMesh cross_solid() {
  return cubes(3, 3, 1, [](int i, int j, int) { return i == 1 || j == 1; });
}
/// Returns three bars that cross in the middle.
inline TriangleMesh jack_solid() {
  return cubes(3, 3, 3, [](int i, int j, int k) { return (i == 1) + (j == 1) + (k == 1) >= 2; });
}
inline TriangleMesh stairs() {
  return cubes(5, 5, 2, [](int i, int j, int) { return j <= i; });
}
/// Returns a plate with two holes.
inline TriangleMesh frame() {
  return cubes(5, 4, 2, [](int i, int j, int) { return i % 2 == 0 || j % 3 == 0; });
}
inline TriangleMesh notched_box() {
  return cubes(3, 1, 2, [](int i, int, int k) { return i != 1 || k == 0; });
}
/// Returns a block with a pocket in one face.
inline TriangleMesh pocketed_box() {
  return cubes(3, 3, 2, [](int i, int j, int k) { return i != 1 || j != 1 || k == 0; });
}
/// Returns a cube with a tunnel along every axis: a surface of genus five.
inline TriangleMesh sponge() {
  return cubes(3, 3, 3, [](int i, int j, int k) { return (i == 1) + (j == 1) + (k == 1) < 2; });
}
/// Returns a cube with a void inside.
inline TriangleMesh hollow_box() {
  return cubes(3, 3, 3, [](int i, int j, int k) { return i != 1 || j != 1 || k != 1; });
}

/// Returns a thick half shell, open at the top.
inline TriangleMesh bowl(Real outer, Real inner, uint32_t around, uint32_t rings) {
  std::vector<Eigen::Vector2d> profile;
  for (uint32_t k = 0; k <= rings; ++k) {
    const Real theta = std::numbers::pi / 2 * k / rings;
    profile.emplace_back(k == 0 ? 0 : outer * std::sin(theta), -outer * std::cos(theta));
  }
  for (uint32_t k = rings + 1; k-- > 0;) {
    const Real theta = std::numbers::pi / 2 * k / rings;
    profile.emplace_back(k == 0 ? 0 : inner * std::sin(theta), -inner * std::cos(theta));
  }
  return lathe(profile, around);
}

/// Returns the mesh rotated at random, moved by up to 1 along each axis, and then scaled by `scale`. The
/// random numbers depend only on `seed`.
inline TriangleMesh placed_at_random(TriangleMesh mesh, Real scale, uint64_t seed) {
  const Scatter random{seed};
  const auto signed_unit = [&](uint64_t k) { return 2 * random.uniform(0, k) - 1; };
  const Quat turn = Quat(signed_unit(0), signed_unit(1), signed_unit(2), signed_unit(3)).normalized();
  const Vec3 shift(signed_unit(4), signed_unit(5), signed_unit(6));
  for (Vec3& v : mesh.vertices) v = scale * (turn * v + shift);
  return mesh;
}

}  // namespace offstage::sim
