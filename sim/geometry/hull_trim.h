#pragma once
/// Trimming of hulls where they bridge hollows of the solid.

#include <span>

#include "sim/geometry/solid_piece.h"

namespace offstage::sim {

struct TrimmedHull {
  ConvexPolyhedron hull;
  Real error = 0;  ///< volume in which the hull and the solid differ [m^3]
};

/// Moves the faces of the hull of some pieces inwards where that makes the volume in which the hull and the
/// pieces differ smaller: a face over a hollow comes to lie about half way between the rim and the ground.
/// No face moves farther than `limit` [m], so that nothing that sticks out is lost. `shared`: volume that is
/// in several of the pieces [m^3].
TrimmedHull trimmed(ConvexPolyhedron hull, std::span<const SolidPiece* const> pieces, Real shared,
                    Real limit);

}  // namespace offstage::sim
