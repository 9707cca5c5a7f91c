#pragma once
/// Pieces of a solid between cut planes. The surface of a piece consists of polygons and of caps. Caps lie on
/// the cut planes and are given only by their outlines, which is sufficient for volumes. Each cut closes the
/// surface again. The surface need not be connected, manifold or free of self-intersections; only its edges
/// must cancel, as in a closed mesh with consistent winding. A region that the surface winds around several
/// times counts several times.

#include <array>
#include <cstdint>
#include <vector>

#include "sim/geometry/convex_polyhedron.h"
#include "sim/geometry/mesh.h"

namespace offstage::sim {

struct SolidPiece {
  using Plane = ConvexPolyhedron::Plane;
  using Side = std::array<uint32_t, 2>;
  /// The part of a cut plane that closes the surface; the normal points out of the piece. The sides form
  /// closed outlines, counter-clockwise seen from the tip of the normal, in any order.
  struct Cap {
    Plane plane;
    std::vector<Side> sides;
  };

  std::vector<Vec3> points;       ///< [m]
  std::vector<uint32_t> corners;  ///< corners of the polygons of the surface, as indices of points
  /// Index of each polygon's first corner; the last entry is the number of corners.
  std::vector<uint32_t> first = {0};
  std::vector<Cap> caps;

  std::size_t polygon_count() const { return first.size() - 1; }
};

/// Converts the solid that a mesh bounds. The net number of triangles along each edge must be zero.
SolidPiece solid_piece(const TriangleMesh& mesh);
/// Converts a convex polyhedron of dimension 3.
SolidPiece solid_piece(const ConvexPolyhedron& polyhedron);

/// Integrals over a piece or a part of it.
struct PieceMoments {
  Real volume = 0;            ///< [m^3]; negative for an inverted surface
  Vec3 first = Vec3::Zero();  ///< first moment of the volume about the frame's origin [m^4]
};
PieceMoments moments(const SolidPiece& piece);
/// Returns the moments of the part above a plane. They equal moments(cut(...)[0]) within rounding, but are
/// computed faster.
PieceMoments moments_above(const SolidPiece& piece, const SolidPiece::Plane& plane);

/// The parts of a piece above and below a plane. Points within `tolerance` of the plane count as on it; a
/// polygon on the plane belongs to the side where the solid is.
std::array<SolidPiece, 2> cut(const SolidPiece& piece, const SolidPiece::Plane& plane, Real tolerance);

/// Returns each edge of a polygon and each side of a cap once, as a pair of points.
std::vector<SolidPiece::Side> edges(const SolidPiece& piece);

}  // namespace offstage::sim
