#pragma once
/// Contact normals that the surface of a triangle mesh allows. A contact at an edge or a vertex pushes only
/// in directions inside the Voronoi region of this feature. In these directions no other feature of the
/// surface is nearer. An edge between coplanar triangles allows only their normal, and a concave edge allows
/// none, so neither stops objects that slide over it.

#include <array>
#include <cstdint>
#include <vector>

#include "sim/geometry/mesh.h"

namespace offstage::sim {

/// The neighbours of each triangle of a mesh. They are computed once for each mesh.
class MeshSurface {
 public:
  MeshSurface(const TriangleMesh& mesh, const MeshTopology& topology);

  /// The neighbours of a face across its edges (0,1), (1,2), (2,0). Slivers are skipped. kNoFace at a border.
  const std::array<uint32_t, 3>& across(uint32_t face) const { return faces_[face].across; }
  /// Whether a vertex of the face is at a border of the mesh, beyond which the surface is unknown.
  bool is_at_border(uint32_t face) const { return faces_[face].at_border; }
  /// Whether the triangle is too thin to have a reliable normal.
  bool is_sliver(uint32_t face) const { return faces_[face].sliver; }

 private:
  struct Face {
    std::array<uint32_t, 3> across;
    bool at_border, sliver;
  };
  std::vector<Face> faces_;
};

class CollisionMesh;

/// A direction runs along a triangle if its sine to the triangle's plane is at most this.
constexpr Real kAlongside = 0.01;

/// One side of a triangle of a mesh.
struct SurfaceTriangle {
  const CollisionMesh* mesh = nullptr;
  uint32_t face = 0;
  int side = 1;  ///< 1: the front, from which the vertices are counter-clockwise; -1: the back

  /// Unit normal on this side; zero if the triangle has no area.
  Vec3 normal() const;
  /// Corner k, 0 to 2.
  const Vec3& corner(std::size_t k) const;
  /// Slope of the neighbouring triangle across the edge (k, k + 1): sine of its angle below this triangle's
  /// plane. Positive at a ridge, negative in a valley, 0 if the surface is flat or ends at the edge.
  Real fall(std::size_t k) const;
  /// The triangle across the edge (k, k + 1), on the same side of the surface, whatever its winding. The
  /// surface must not end there.
  SurfaceTriangle neighbour(std::size_t k) const;
  /// Whether a contact at a point of the triangle can push along the unit vector `n` on this side. `guard`, 0
  /// to 1, also allows normals slightly outside of the region of a ridge: by up to this fraction of its
  /// slope.
  bool allows(const Vec3& point, const Vec3& n, Real guard = 0) const;
  /// Whether the unit vector `n` at a point of the triangle runs along a neighbouring triangle that contains
  /// this point.
  bool runs_along_neighbour(const Vec3& point, const Vec3& n) const;

 private:
  bool edge_allows(std::size_t k, const Vec3& n, Real guard) const;
  bool vertex_allows(uint32_t vertex, const Vec3& n, Real guard) const;
  /// Square of the distance within which points count as on an edge or a vertex [m^2].
  Real near2() const;
};

}  // namespace offstage::sim
