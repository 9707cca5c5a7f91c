#pragma once
/// Triangle meshes with the adjacency and the normals by feature that registration computes once (physics
/// E2). Faces are counter-clockwise seen from outside.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sim/core/types.h"

namespace offstage::sim {

using Triangle = std::array<uint32_t, 3>;
inline constexpr uint32_t kNoFace = 0xffffffff;

/// Vertices and triangles as given by the user.
struct TriangleMesh {
  std::vector<Vec3> vertices;       ///< [m]
  std::vector<Triangle> triangles;  ///< indices into `vertices`
};

/// An undirected edge between two vertices. `faces[1]` is kNoFace on a border.
struct Edge {
  std::array<uint32_t, 2> vertices;
  std::array<uint32_t, 2> faces;
};

/// Defects of a mesh as the surface of a solid. All are zero for a closed mesh with consistent winding.
struct MeshDefects {
  uint32_t border_edges = 0;        ///< edges with one face: the mesh is open
  uint32_t non_manifold_edges = 0;  ///< edges with three or more faces
  uint32_t flipped_edges = 0;       ///< edges whose two faces have opposite winding
  uint32_t degenerate_faces = 0;    ///< faces of zero area or with a repeated vertex
  bool inverted = false;            ///< whether the enclosed volume is negative

  bool closed() const { return border_edges == 0 && non_manifold_edges == 0 && flipped_edges == 0; }
  /// Returns one line that names every defect; empty if there is none.
  std::string describe() const;
};

/// Merges vertices at the same position (bitwise), removes faces that become degenerate, then unused
/// vertices. Importers split vertices along texture seams; physics needs them joined. Faces whose winding
/// differs from most of the surrounding surface are flipped, because contacts depend on the side of a
/// surface.
TriangleMesh weld(const TriangleMesh& mesh);

/// Connectivity and normals of a mesh. Every query is O(1).
class MeshTopology {
 public:
  explicit MeshTopology(const TriangleMesh& mesh);

  const std::vector<Edge>& edges() const { return edges_; }
  /// The three faces across the edges (0,1), (1,2), (2,0) of a face; kNoFace on a border.
  const std::array<uint32_t, 3>& face_neighbours(uint32_t face) const { return face_neighbours_[face]; }
  /// The three edges (0,1), (1,2), (2,0) of a face as indices into edges().
  const std::array<uint32_t, 3>& face_edges(uint32_t face) const { return face_edges_[face]; }
  /// Faces around a vertex, in ascending order.
  std::span<const uint32_t> vertex_faces(uint32_t vertex) const;
  /// Vertices that share an edge with a vertex, in ascending order.
  std::span<const uint32_t> vertex_neighbours(uint32_t vertex) const;

  /// Unit normal; zero for a degenerate face.
  const Vec3& face_normal(uint32_t face) const { return face_normals_[face]; }
  /// Unit vector along the mean of the normals of the edge's faces.
  const Vec3& edge_normal(uint32_t edge) const { return edge_normals_[edge]; }
  const Vec3& vertex_normal(uint32_t vertex) const {
    return vertex_normals_[vertex];
  }  ///< unit mean of the normals around the vertex, weighted by angle

  const MeshDefects& defects() const { return defects_; }

 private:
  std::vector<Edge> edges_;
  std::vector<std::array<uint32_t, 3>> face_neighbours_, face_edges_;
  std::vector<uint32_t> vertex_face_start_, vertex_faces_;
  std::vector<uint32_t> vertex_neighbour_start_, vertex_neighbours_;
  std::vector<Vec3> face_normals_, edge_normals_, vertex_normals_;
  MeshDefects defects_;
};

}  // namespace offstage::sim
