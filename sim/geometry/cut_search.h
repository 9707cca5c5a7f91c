#pragma once
/// Search for the plane that cuts a piece of a solid best.

#include <optional>
#include <vector>

#include "sim/geometry/solid_piece.h"

namespace offstage::sim {

/// A piece with its hull.
struct HulledPiece {
  SolidPiece solid;
  ConvexPolyhedron hull;
  PieceMoments moments;   ///< moments of the solid
  Real excess = 0;        ///< volume of the hull that is empty [m^3]
  uint32_t solid_id = 0;  ///< index of the solid to which the piece belongs
};

HulledPiece with_hull(SolidPiece solid, uint32_t solid_id);

/// An edge of the surface at which the solid is concave.
struct ReflexEdge {
  Vec3 from, to;
  Vec3 left, right;  ///< unit outward normals of its faces
};
/// Edges of the polygons of a solid at which the solid is concave by more than about 5 degrees.
std::vector<ReflexEdge> sharp_reflex_edges(const SolidPiece& solid);

/// Returns the plane that minimizes the total volume of the hulls of both sides; among similar planes it
/// chooses the plane with the most compact sides. `reflex`: sharp_reflex_edges() of the whole solid. The
/// result is empty if no plane divides the piece. Distances below `tolerance` count as zero [m].
std::optional<SolidPiece::Plane> best_cut(const HulledPiece& piece, const std::vector<ReflexEdge>& reflex,
                                          Real tolerance);

}  // namespace offstage::sim
