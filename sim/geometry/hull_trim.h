#pragma once
/// Trimming of convex hulls where they extend over hollows of the solid.

#include <span>

#include "sim/geometry/solid_piece.h"

namespace offstage::sim {

struct TrimmedHull {
  ConvexPolyhedron hull;
  Real error = 0;  ///< volume in which the hull and the solid differ [m^3]
};

/// Moves faces of the hull of some pieces inwards where this reduces the volume in which hull and pieces
/// differ. A face over a hollow moves about half way to the bottom of the hollow. No face moves farther than
/// `limit` [m], so that protruding features are kept. `shared`: volume that is in several of the pieces
/// [m^3].
TrimmedHull trimmed(ConvexPolyhedron hull, std::span<const SolidPiece* const> pieces, Real shared,
                    Real limit);

}  // namespace offstage::sim
