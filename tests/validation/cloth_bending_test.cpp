/// Bending of cloth against the closed forms of thin plates and strips, on several triangulations.

#include <cmath>
#include <map>
#include <numbers>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "random.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

enum class Mesh { alternating, diagonal, random };

/// Turns edges until each triangle's circle is empty (Delaunay), of points in the plane y = 0.
void flip_to_delaunay(std::vector<Triangle>& triangles, const std::vector<Vec3>& points) {
  const auto opposite = [&](const Triangle& t, uint32_t a, uint32_t b) {
    for (uint32_t k : t)
      if (k != a && k != b) return k;
    return a;
  };
  const auto angle = [&](uint32_t at, uint32_t a, uint32_t b) {
    const Vec3 u = points[a] - points[at], v = points[b] - points[at];
    return std::atan2(u.cross(v).norm(), u.dot(v));
  };
  for (bool again = true; again;) {
    again = false;
    std::map<std::pair<uint32_t, uint32_t>, std::vector<std::size_t>> edges;
    for (std::size_t t = 0; t < triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k)
        edges[std::minmax(triangles[t][k], triangles[t][(k + 1) % 3])].push_back(t);
    for (const auto& [edge, sides] : edges) {
      if (sides.size() != 2) continue;
      const auto [a, b] = edge;
      const uint32_t c = opposite(triangles[sides[0]], a, b), d = opposite(triangles[sides[1]], a, b);
      if (angle(c, a, b) + angle(d, a, b) <= std::numbers::pi + 1e-9) continue;
      const auto upward = [&](Triangle t) {
        const Vec3 n = (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]);
        if (n.y() < 0) std::swap(t[1], t[2]);
        return t;
      };
      triangles[sides[0]] = upward({c, d, a});
      triangles[sides[1]] = upward({d, c, b});
      again = true;
      break;
    }
  }
}

/// Returns a strip along x with `cells` cells along its length, and cells of the same size across it.
TriangleMesh strip(Mesh kind, uint32_t cells, Real length, Real width) {
  TriangleMesh mesh;
  const uint32_t rows = std::max(2u, static_cast<uint32_t>(std::lround(cells * width / length)));
  const Scatter scatter{7};
  const auto jitter = [&](uint32_t r, uint32_t c, uint32_t axis) {
    return 0.6 * scatter.uniform(r * 1000 + c, axis) - 0.3;
  };
  for (uint32_t r = 0; r <= rows; ++r)
    for (uint32_t c = 0; c <= cells; ++c) {
      Vec3 p(length * c / cells, 0, width * r / rows);
      // The first two columns are the clamp.
      if (kind == Mesh::random && c > 1 && c < cells) p.x() += jitter(r, c, 0) * length / cells;
      if (kind == Mesh::random && r > 0 && r < rows) p.z() += jitter(r, c, 1) * width / rows;
      mesh.vertices.push_back(p);
    }
  const auto at = [&](uint32_t c, uint32_t r) { return r * (cells + 1) + c; };
  for (uint32_t r = 0; r < rows; ++r)
    for (uint32_t c = 0; c < cells; ++c) {
      const uint32_t a = at(c, r), b = at(c + 1, r), d = at(c, r + 1), e = at(c + 1, r + 1);
      if (kind == Mesh::diagonal || (r + c) % 2 == 0)
        mesh.triangles.insert(mesh.triangles.end(), {Triangle{a, d, e}, Triangle{a, e, b}});
      else
        mesh.triangles.insert(mesh.triangles.end(), {Triangle{a, d, b}, Triangle{b, d, e}});
    }
  if (kind == Mesh::random) flip_to_delaunay(mesh.triangles, mesh.vertices);
  return mesh;
}

effects::Fabric card(Real rigidity, Real density) {
  effects::Fabric f = effects::find_fabric("cotton")->fabric;
  f.areal_density = density;
  f.stretch = 5000;
  f.shear = 2000;
  f.bend = rigidity;
  f.bend_damping = 0.05;
  f.max_stretch = 0;
  return f;
}

/// Mesh, cells along the length, and integrator.
class ClothCantilever : public testing::TestWithParam<std::tuple<Mesh, uint32_t, ClothIntegrator>> {};

TEST_P(ClothCantilever, SagsByItsFlexuralRigidity) {
  // The end of a clamped strip of the length L sags by w L^4 / 8 B. The error falls with the square of the
  // size of the cells.
  const auto [mesh, cells, integrator] = GetParam();
  constexpr Real kLength = 0.1, kRigidity = 0.01, kDensity = 0.2;
  ClothDef def = effects::mesh_cloth(strip(mesh, cells, kLength, 0.025), {}, card(kRigidity, kDensity));
  def.self_collision = def.collides = false;
  def.air.density = 0;
  def.integrator = integrator;
  for (uint32_t i = 0; i < def.vertices.size(); ++i)
    if (def.vertices[i].x() < 1.5 * kLength / cells)
      def.pins.push_back({.vertex = i, .position = def.vertices[i]});
  World world;
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 24; ++i) world.step(1.0 / 24);
  Real sag = 0, count = 0;
  for (uint32_t i = 0; i < def.vertices.size(); ++i)
    if (def.vertices[i].x() > 0.999 * kLength) {
      sag -= world.cloth(cloth).points[i].y();
      ++count;
    }
  const Real free_length = kLength * (cells - 1) / cells;
  EXPECT_NEAR(sag / count / (kDensity * 9.81 * std::pow(free_length, 4) / (8 * kRigidity)), 1,
              3.8 / (cells * cells));
}

INSTANTIATE_TEST_SUITE_P(Meshes, ClothCantilever,
                         testing::Combine(testing::Values(Mesh::alternating, Mesh::diagonal, Mesh::random),
                                          testing::Values(7u, 20u),
                                          testing::Values(ClothIntegrator::relaxed,
                                                          ClothIntegrator::implicit)));

}  // namespace
}  // namespace offstage::sim
