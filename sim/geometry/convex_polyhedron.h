#pragma once
/// Convex polyhedra with polygonal faces and the adjacency that V-Clip, hill climbing and the clipping of
/// contact faces use. Flat and straight sets and single points are convex, too, and are stored as such: a
/// polygon is two faces back to back, a segment is an edge without faces, a point is a single vertex.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/core/types.h"
#include "sim/geometry/mesh.h"

namespace offstage::sim {

class ConvexPolyhedron {
 public:
  /// An edge from vertex `tail` to vertex `head`, with the faces on its left and right, seen from outside.
  /// Both faces are kNoFace for a segment.
  struct Edge {
    uint32_t tail, head;
    uint32_t left, right;
  };
  /// The unit vectors that bound the Voronoi regions at an edge (Mirtich, "V-Clip", 1998): along the edge
  /// from tail to head, and perpendicular to it in the planes of its faces, pointing into the faces. The
  /// vector is zero where there is no face.
  struct EdgeFrame {
    Vec3 along, into_left, into_right;
  };
  /// The plane n.x = offset of a face.
  struct Plane {
    Vec3 normal;  ///< unit, outward
    Real offset;
  };

  ConvexPolyhedron() = default;
  /// Builds a polyhedron from faces whose vertices are counter-clockwise seen from outside. The caller must
  /// make sure that it is convex and closed; convex_hull() creates one from any points. Without faces, at
  /// most two vertices are allowed. Throws std::invalid_argument for an index out of range, a face of less
  /// than three vertices, or an edge that does not have exactly two faces in opposite directions.
  ConvexPolyhedron(std::vector<Vec3> vertices, std::span<const std::vector<uint32_t>> faces);

  std::span<const Vec3> vertices() const { return vertices_; }
  const Vec3& vertex(uint32_t v) const { return vertices_[v]; }
  std::span<const Edge> edges() const { return edges_; }
  const Edge& edge(uint32_t e) const { return edges_[e]; }
  const EdgeFrame& edge_frame(uint32_t e) const { return edge_frames_[e]; }
  uint32_t face_count() const { return static_cast<uint32_t>(planes_.size()); }
  const Plane& plane(uint32_t face) const { return planes_[face]; }

  /// Vertices around a face, counter-clockwise seen from outside.
  std::span<const uint32_t> face_vertices(uint32_t face) const { return face_vertices_.row(face); }
  /// Edges around a face: edge k connects vertex k and the next.
  std::span<const uint32_t> face_edges(uint32_t face) const { return face_edges_.row(face); }
  /// Edges at a vertex, and the vertices at their other ends, in the same order.
  std::span<const uint32_t> vertex_edges(uint32_t vertex) const { return vertex_edges_.row(vertex); }
  std::span<const uint32_t> vertex_neighbours(uint32_t vertex) const {
    return vertex_neighbours_.row(vertex);
  }

  /// Dimension: 3 for a solid, 2 for a polygon, 1 for a segment, 0 for a point.
  int dimension() const { return dimension_; }
  /// The mean of the vertices, a point inside.
  const Vec3& centre() const { return centre_; }
  /// Distance of the farthest vertex from the frame's origin [m].
  Real reach() const { return reach_; }
  /// Box around the vertices.
  const Aabb& box() const { return box_; }

  /// Returns the faces as triangles, each face divided into a fan.
  TriangleMesh triangles() const;

 private:
  /// Rows of different lengths in one array.
  struct Rows {
    std::vector<uint32_t> start{0}, items;
    std::span<const uint32_t> row(uint32_t i) const {
      return {items.data() + start[i], items.data() + start[i + 1]};
    }
  };

  void find_edges();
  void find_planes();
  void find_edge_frames();

  std::vector<Vec3> vertices_;
  std::vector<Edge> edges_;
  std::vector<EdgeFrame> edge_frames_;
  std::vector<Plane> planes_;
  Rows face_vertices_, face_edges_, vertex_edges_, vertex_neighbours_;
  Vec3 centre_ = Vec3::Zero();
  Aabb box_;
  Real reach_ = 0;
  int dimension_ = 0;
};

/// Returns a box with the edge lengths `size` [m], centred at the origin.
ConvexPolyhedron box_polyhedron(const Vec3& size);

/// Greatest height of a vertex above the plane of a face [m]. For a convex polyhedron it is at most a
/// rounding error.
Real concavity(const ConvexPolyhedron& p);

}  // namespace offstage::sim
