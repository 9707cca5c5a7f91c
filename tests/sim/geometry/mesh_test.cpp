#include "sim/geometry/mesh.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/meshes.h"

namespace offstage::sim {
namespace {

TEST(Topology, ClosedMeshesObeyEulersFormula) {
  for (const auto& [mesh, characteristic] :
       {std::pair(box_mesh(Vec3(1, 2, 3)), 2), std::pair(sphere_mesh(1, 12, 7), 2),
        std::pair(torus_mesh(2, 0.5, 12, 9), 0)}) {
    const MeshTopology topology(mesh);
    const auto count = [](const auto& v) { return static_cast<int>(v.size()); };
    EXPECT_EQ(count(mesh.vertices) - count(topology.edges()) + count(mesh.triangles), characteristic);
    EXPECT_TRUE(topology.defects().closed());
    EXPECT_EQ(topology.defects().describe(), "");
  }
}

TEST(Topology, NeighboursAreMutualAndShareTheEdge) {
  const TriangleMesh mesh = torus_mesh(2, 0.5, 9, 7);
  const MeshTopology topology(mesh);
  for (uint32_t f = 0; f < mesh.triangles.size(); ++f)
    for (std::size_t k = 0; k < 3; ++k) {
      const uint32_t other = topology.face_neighbours(f)[k];
      const auto& back = topology.face_neighbours(other);
      EXPECT_TRUE(std::find(back.begin(), back.end(), f) != back.end());
      auto ends = topology.edges()[topology.face_edges(f)[k]].vertices;
      std::array<uint32_t, 2> side = {mesh.triangles[f][k], mesh.triangles[f][(k + 1) % 3]};
      std::sort(side.begin(), side.end());
      EXPECT_EQ(ends, side);
    }
}

TEST(Topology, VertexListsAreAscendingAndComplete) {
  const TriangleMesh mesh = sphere_mesh(1, 8, 5);
  const MeshTopology topology(mesh);
  for (uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    const auto faces = topology.vertex_faces(v), neighbours = topology.vertex_neighbours(v);
    EXPECT_EQ(faces.size(), neighbours.size());  // the faces around the vertex form a closed fan
    EXPECT_TRUE(std::is_sorted(faces.begin(), faces.end()));
    EXPECT_TRUE(std::is_sorted(neighbours.begin(), neighbours.end()));
    for (uint32_t f : faces)
      EXPECT_TRUE(std::find(mesh.triangles[f].begin(), mesh.triangles[f].end(), v) !=
                  mesh.triangles[f].end());
  }
}

TEST(Topology, CornerOfABoxPointsAlongTheDiagonalForAnyTriangulation) {
  const TriangleMesh mesh = box_mesh(Vec3::Ones());
  const MeshTopology topology(mesh);
  for (uint32_t v = 0; v < 8; ++v)
    EXPECT_NEAR((topology.vertex_normal(v) - mesh.vertices[v].normalized()).norm(), 0, 1e-15);
}

TEST(Topology, NamesEveryDefect) {
  TriangleMesh mesh = box_mesh(Vec3::Ones());
  mesh.triangles.pop_back();
  EXPECT_EQ(MeshTopology(mesh).defects().border_edges, 3u);
  EXPECT_EQ(MeshTopology(mesh).defects().describe(), "3 border edges");

  mesh = box_mesh(Vec3::Ones());
  std::swap(mesh.triangles[0][0], mesh.triangles[0][1]);
  EXPECT_EQ(MeshTopology(mesh).defects().flipped_edges, 3u);

  mesh = box_mesh(Vec3::Ones());
  mesh.triangles.push_back({0, 3, 7});
  EXPECT_GT(MeshTopology(mesh).defects().non_manifold_edges, 0u);

  mesh = box_mesh(Vec3::Ones());
  for (Triangle& t : mesh.triangles) std::swap(t[0], t[1]);
  EXPECT_TRUE(MeshTopology(mesh).defects().inverted);
  EXPECT_TRUE(MeshTopology(mesh).defects().closed());
}

TEST(Weld, JoinsSplitVerticesIntoAClosedMesh) {
  const TriangleMesh box = box_mesh(Vec3::Ones());
  TriangleMesh soup;
  for (const Triangle& t : box.triangles)
    for (uint32_t v : t) soup.vertices.push_back(box.vertices[v]);
  for (uint32_t f = 0; f < box.triangles.size(); ++f) soup.triangles.push_back({3 * f, 3 * f + 1, 3 * f + 2});
  soup.vertices.push_back(Vec3(9, 9, 9));
  soup.triangles.push_back({0, 0, 1});
  EXPECT_FALSE(MeshTopology(soup).defects().closed());
  const TriangleMesh joined = weld(soup);
  EXPECT_EQ(joined.vertices.size(), 8u);
  EXPECT_EQ(joined.triangles.size(), 12u);
  EXPECT_TRUE(MeshTopology(joined).defects().closed());
}

TEST(Weld, TurnsFacesThatAreWoundOtherwiseThanMost) {
  TriangleMesh mesh = box_mesh(Vec3::Ones());
  for (const std::size_t f : {0u, 3u, 4u, 10u}) std::swap(mesh.triangles[f][1], mesh.triangles[f][2]);
  EXPECT_FALSE(MeshTopology(mesh).defects().closed());
  const MeshDefects defects = MeshTopology(weld(mesh)).defects();
  EXPECT_TRUE(defects.closed());
  EXPECT_FALSE(defects.inverted);
}

TEST(Weld, LeavesASurfaceWithOneSideAlone) {
  // A Moebius strip of six quads.
  TriangleMesh strip;
  for (int i = 0; i < 6; ++i)
    for (const Real r : {0.8, 1.2}) {
      const Real angle = i * std::numbers::pi / 3, tilt = (r - 1) * std::cos(angle / 2);
      const Real out = 1 + tilt;
      strip.vertices.emplace_back(out * std::cos(angle), (r - 1) * std::sin(angle / 2),
                                  out * std::sin(angle));
    }
  for (uint32_t i = 0; i < 6; ++i) {
    const uint32_t a = 2 * i, b = a + 1, c = i < 5 ? a + 2 : 1, d = i < 5 ? a + 3 : 0;
    strip.triangles.push_back({a, b, c});
    strip.triangles.push_back({b, d, c});
  }
  ASSERT_EQ(MeshTopology(strip).defects().flipped_edges, 1u);
  EXPECT_EQ(weld(strip).triangles, strip.triangles);
}

TEST(Weld, NegativeZeroIsZero) {
  const TriangleMesh mesh = {{Vec3(0.0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(-0.0, 0, 0), Vec3(0, 0, 1)},
                             {{0, 1, 2}, {3, 2, 4}}};
  EXPECT_EQ(weld(mesh).vertices.size(), 4u);
}

}  // namespace
}  // namespace offstage::sim
