#pragma once
/// The boundary of a solid as convex polygons joined along half-edges, which Joe's decomposition cuts
/// (physics N8, the book's appendix F).
///
/// Only the twins of half-edges define connections. Two faces may be at the same place without being
/// connected, for example both sides of a cut through a ring.

#include <cstdint>
#include <vector>

#include "sim/geometry/convex_polyhedron.h"
#include "sim/geometry/mesh.h"

namespace offstage::sim {

struct Polyhedron {
  using Plane = ConvexPolyhedron::Plane;
  /// The face of a half-edge is on its left, seen from outside. `sibling` is another half-edge that leaves
  /// the same point, set by components(). Siblings form a cycle, even if they are not connected around a
  /// corner.
  struct HalfEdge {
    uint32_t origin = 0, face = 0, next = 0, previous = 0, twin = 0, sibling = 0;
  };
  struct Face {
    uint32_t first = 0;  ///< one of the face's half-edges
    Plane plane;
  };

  std::vector<Vec3> points;  ///< [m]
  std::vector<HalfEdge> half_edges;
  std::vector<Face> faces;

  uint32_t origin(uint32_t h) const { return half_edges[h].origin; }
  uint32_t head(uint32_t h) const { return half_edges[half_edges[h].next].origin; }
  const Vec3& origin_point(uint32_t h) const { return points[origin(h)]; }
  const Vec3& head_point(uint32_t h) const { return points[head(h)]; }
  const Plane& plane(uint32_t h) const { return faces[half_edges[h].face].plane; }

  /// Calls f for every half-edge that leaves the origin of `h` and is connected with it around that corner.
  template <class F>
  void for_each_leaving(uint32_t h, F&& f) const {
    uint32_t k = h;
    do {
      f(k);
      k = half_edges[half_edges[k].previous].twin;
    } while (k != h);
  }

  template <class F>
  void for_each_around(uint32_t face, F&& f) const {
    uint32_t h = faces[face].first;
    do {
      f(h);
      h = half_edges[h].next;
    } while (h != faces[face].first);
  }
};

/// The solid around an edge, described by angles about the edge [rad]. The angle is 0 at the face on the left
/// and increases through the solid to `angle` at the face on the right.
struct Wedge {
  Vec3 along;   ///< unit direction of the edge
  Vec3 normal;  ///< normal of the left face
  Vec3 left;    ///< unit direction into the left face
  Real angle;   ///< the interior dihedral angle, in [0, 2 pi) [rad]

  Wedge(const Vec3& along, const Vec3& left_normal, const Vec3& right_normal);
  /// Angle of a direction, which need not be perpendicular to the edge; in [0, 2 pi) [rad].
  Real angle_of(const Vec3& direction) const;
  Vec3 direction(Real theta) const;
  /// Unit normal of the plane through the edge and direction(theta), on the side of the left face.
  Vec3 plane_normal(Real theta) const;
};

/// Returns the wedge at a half-edge, between its face and the face of its twin.
Wedge wedge(const Polyhedron& p, uint32_t half_edge);

/// Builds one polyhedron for each connected piece of the surface. Neighbouring triangles that lie in one
/// plane within `tolerance` are merged into convex polygons with the same plane, unless they enclose a hole
/// or touch themselves at a vertex. The mesh must be closed and consistently wound; triangles that repeat a
/// vertex are left out.
std::vector<Polyhedron> boundaries(const TriangleMesh& mesh, const MeshTopology& topology, Real tolerance);

/// The connected pieces of a surface, each as a polyhedron of its own.
std::vector<Polyhedron> components(const Polyhedron& p);

/// Six times the signed volume [m^3].
Real signed_volume6(const Polyhedron& p);

}  // namespace offstage::sim
