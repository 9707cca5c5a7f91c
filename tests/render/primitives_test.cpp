#include "render/primitives.h"

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace offstage::render {
namespace {

struct Named {
  const char* name;
  Mesh mesh;
  double area, volume;  // values of the exact shape
  Vector3f size;
};

std::vector<Named> closed_primitives() {
  // The bevelled box is the Minkowski sum of a box of 0.8 x 1.8 x 2.8 with a ball of radius 0.1 (Steiner's
  // formula).
  const double a = 0.8, b = 1.8, c = 2.8, r = 0.1;
  const double box_area =
      2 * (a * b + b * c + c * a) + 2 * std::numbers::pi * r * (a + b + c) + 4 * std::numbers::pi * r * r;
  const double box_volume = a * b * c + 2 * r * (a * b + b * c + c * a) +
                            std::numbers::pi * r * r * (a + b + c) + 4 * std::numbers::pi / 3 * r * r * r;
  return {{"sphere", make_sphere(2, 96), 16 * std::numbers::pi, 32 * std::numbers::pi / 3, {4, 4, 4}},
          {"box", make_box({1, 2, 3}), 22, 6, {1, 2, 3}},
          {"bevelled box", make_box({1, 2, 3}, 0.1f), box_area, box_volume, {1, 2, 3}},
          {"capsule",
           make_capsule(0.5f, 2, 96),
           2 * std::numbers::pi + std::numbers::pi,
           0.5 * std::numbers::pi + std::numbers::pi / 6,
           {1, 3, 1}},
          {"cylinder",
           make_cylinder(0.5f, 2, 96),
           2 * std::numbers::pi + 0.5 * std::numbers::pi,
           0.5 * std::numbers::pi,
           {1, 2, 1}},
          {"cone",
           make_cone(0.5f, 2, 96),
           std::numbers::pi * 0.25 + std::numbers::pi * 0.5 * std::sqrt(4.25),
           std::numbers::pi / 6,
           {1, 2, 1}}};
}

std::array<float, 3> key(const Vector3f& p) {
  return {p.x() + 0.0f, p.y() + 0.0f, p.z() + 0.0f};
}

struct Totals {
  double area = 0, volume = 0;
};

Totals totals_of(const Mesh& mesh) {
  Totals totals;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const Eigen::Vector3d a = mesh.positions[mesh.indices[i]].cast<double>();
    const Eigen::Vector3d b = mesh.positions[mesh.indices[i + 1]].cast<double>();
    const Eigen::Vector3d c = mesh.positions[mesh.indices[i + 2]].cast<double>();
    totals.area += 0.5 * (b - a).cross(c - a).norm();
    totals.volume += a.dot(b.cross(c)) / 6;
  }
  return totals;
}

// Counts the edges that do not occur exactly once in each direction between bitwise equal positions.
int bad_edges(const Mesh& mesh) {
  std::map<std::pair<std::array<float, 3>, std::array<float, 3>>, int> edges;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto from = key(mesh.positions[mesh.indices[i + k]]);
      const auto to = key(mesh.positions[mesh.indices[i + (k + 1) % 3]]);
      ++edges[{from, to}];
    }
  }
  int bad = 0;
  for (const auto& [edge, count] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    bad += count != 1 || back == edges.end() || back->second != 1;
  }
  return bad;
}

TEST(Primitives, AreClosedAndWoundOutwards) {
  for (const Named& shape : closed_primitives()) {
    EXPECT_EQ(bad_edges(shape.mesh), 0) << shape.name;
    EXPECT_GT(totals_of(shape.mesh).volume, 0) << shape.name;
  }
}

TEST(Primitives, HaveTheAreaVolumeAndBoundsOfTheirShape) {
  for (const Named& shape : closed_primitives()) {
    const Totals totals = totals_of(shape.mesh);
    EXPECT_NEAR(totals.area / shape.area, 1, 0.005) << shape.name;  // the error is of order 1 / segments^2
    EXPECT_NEAR(totals.volume / shape.volume, 1, 0.0035) << shape.name;
    const Eigen::AlignedBox3f box = shape.mesh.bounds();
    EXPECT_EQ(box.sizes(), shape.size) << shape.name;
    EXPECT_EQ(box.center(), Vector3f(0, 0, 0)) << shape.name;
  }
}

TEST(Primitives, NormalsAreUnitAndFaceTheSameSideAsTheirTriangles) {
  for (const Named& shape : closed_primitives()) {
    const Mesh& mesh = shape.mesh;
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size()) << shape.name;
    ASSERT_EQ(mesh.uvs.size(), mesh.positions.size()) << shape.name;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      const Vector3f& a = mesh.positions[mesh.indices[i]];
      const Vector3f face =
          (mesh.positions[mesh.indices[i + 1]] - a).cross(mesh.positions[mesh.indices[i + 2]] - a);
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector3f& normal = mesh.normals[mesh.indices[i + k]];
        ASSERT_NEAR(normal.norm(), 1, 1e-5) << shape.name;
        ASSERT_GT(normal.dot(face.normalized()), 0.8f) << shape.name;
      }
    }
  }
}

// Texture coordinates increase to the right and downwards, as in pictures.
TEST(Primitives, TexturesAreUprightAndNotMirrored) {
  std::vector<Named> shapes = closed_primitives();
  shapes.push_back({"ground", make_ground(8), 0, 0, {}});
  for (const Named& shape : shapes) {
    const Mesh& mesh = shape.mesh;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      const auto at = [&](std::size_t k) { return mesh.indices[i + k]; };
      const Vector3f a = mesh.positions[at(1)] - mesh.positions[at(0)],
                     b = mesh.positions[at(2)] - mesh.positions[at(0)];
      const Vector2f u = mesh.uvs[at(1)] - mesh.uvs[at(0)], v = mesh.uvs[at(2)] - mesh.uvs[at(0)];
      const float area = u.x() * v.y() - u.y() * v.x();
      const Vector3f normal = a.cross(b).normalized();
      if (std::abs(area) < 1e-6f) continue;  // at a pole
      ASSERT_LT(area, 0) << shape.name << ": mirrored";
      // The direction in which v decreases.
      const Vector3f up = (u.x() * b - v.x() * a) / -area;
      const bool faces_outwards = normal.dot(mesh.positions[at(0)]) > 0;
      if (std::abs(normal.y()) < 0.1f && faces_outwards) {
        ASSERT_GT(up.normalized().y(), 0.9f) << shape.name;
      }
      if (shape.name == std::string("ground")) {
        ASSERT_LT(up.normalized().z(), -0.9f);
      }
    }
  }
}

TEST(Primitives, GroundIsASquareThatFacesUpAndIsFinerInTheMiddle) {
  const Mesh ground = make_ground(1000);
  const Totals totals = totals_of(ground);
  EXPECT_NEAR(totals.area, 4e6, 10);
  EXPECT_EQ(ground.bounds().sizes(), Vector3f(2000, 0, 2000));
  EXPECT_LT(ground.indices.size() / 3, 2000u);
  float smallest = 1e9f;
  for (std::size_t i = 0; i < ground.indices.size(); i += 3) {
    const Vector3f& a = ground.positions[ground.indices[i]];
    const Vector3f normal =
        (ground.positions[ground.indices[i + 1]] - a).cross(ground.positions[ground.indices[i + 2]] - a);
    EXPECT_GT(normal.y(), 0);
    smallest = std::min(smallest, normal.y());
  }
  EXPECT_LT(smallest, 2);
}

TEST(Normals, OfACubeSplitAtItsEdgesAndOfASphereDoNot) {
  Mesh cube;
  for (int i = 0; i < 8; ++i) cube.positions.emplace_back(i & 1, (i >> 1) & 1, i >> 2);
  cube.indices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                  2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  compute_normals(cube);
  EXPECT_EQ(cube.positions.size(), 24u);
  for (const Vector3f& n : cube.normals) EXPECT_FLOAT_EQ(n.cwiseAbs().maxCoeff(), 1);

  Mesh sphere = make_sphere(1, 48);
  const std::vector<Vector3f> exact = sphere.normals;
  sphere.normals.clear();
  compute_normals(sphere);
  ASSERT_EQ(sphere.normals.size(), exact.size());  // no vertex was split, and the seam is smooth
  std::vector<bool> used(exact.size(), false);
  for (const uint32_t i : sphere.indices) used[i] = true;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    if (!used[i]) continue;
    EXPECT_GT(sphere.normals[i].dot(exact[i]), 0.998f);
  }
}

TEST(Normals, WeighByAreaAndIgnoreTrianglesWithoutArea) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {3, 0, 0}, {0, 3, 0}, {0, 0, 1}, {1, 0, 0}};
  mesh.indices = {0, 1, 2,   // area 4.5, normal +z
                  0, 2, 3,   // area 1.5, normal +x
                  0, 4, 1};  // no area
  compute_normals(mesh, 100);
  const Vector3f expected = Vector3f(1.5f, 0, 4.5f).normalized();
  EXPECT_LT((mesh.normals[0] - expected).norm(), 1e-6f);
  for (const Vector3f& n : mesh.normals) EXPECT_NEAR(n.norm(), 1, 1e-6);
}

}  // namespace
}  // namespace offstage::render
