#pragma once
/// Cuts a polyhedron by a plane along one connected cut face (the book's appendix F.2).

#include <cstdint>
#include <optional>
#include <vector>

#include "sim/geometry/polyhedron.h"

namespace offstage::sim {

/// A cut face: the connected region of a plane inside a polyhedron that begins at an edge.
struct Cut {
  /// A corner of the cut face, and the side from it to the next corner.
  struct Corner {
    Vec3 point;
    uint32_t half_edge;  ///< half-edge that leaves the corner or, if `on_edge`, contains it
    bool on_edge;
    /// Whether the side crosses the face of `half_edge`; otherwise the side is the edge `half_edge`.
    bool across_face;
  };
  Polyhedron::Plane plane;
  /// Corners of the cut face, counter-clockwise about the plane's normal.
  std::vector<Corner> corners;
  std::vector<std::vector<uint32_t>> pieces;  ///< convex parts of the cut face, as indices of corners
};

/// Traces the cut face that begins along an edge. The inside of the cut is on the left of the half-edge, seen
/// from the tip of the plane's normal. Points within `tolerance` of the plane count as on it. The result is
/// empty if the cut face has holes or slits, or if its inside touches the surface. The outline may touch
/// itself at vertices.
std::optional<Cut> trace_cut(const Polyhedron& p, uint32_t half_edge, const Polyhedron::Plane& plane,
                             Real tolerance);

/// Cuts a polyhedron along a cut face. Returns two polyhedra, or one that has the cut face twice, if the cut
/// does not divide it (as in a ring).
std::vector<Polyhedron> separate(Polyhedron p, const Cut& cut);

}  // namespace offstage::sim
