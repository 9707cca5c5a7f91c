#pragma once
/// Approximate convex decomposition of a solid by cut planes. The piece whose hull has the most empty space
/// is cut in two until the hulls are good enough; then neighbouring parts are merged as long as this adds
/// little volume, and hulls are trimmed where they extend over hollows. Best-first cuts and mergers as in
/// Mamou and Ghorbel, "A simple and efficient approach for 3D mesh approximate convex decomposition" (2009),
/// and Wei et al., "Approximate convex decomposition for 3D meshes with collision-aware concavity and tree
/// search" (2022); but the pieces are exact, and so are their volumes. Thin shells are divided into Voronoi
/// cells first.

#include <cstddef>
#include <span>
#include <vector>

#include "sim/geometry/convex_polyhedron.h"
#include "sim/geometry/solid_piece.h"

namespace offstage::sim {

struct CutGoal {
  Real max_error = 0.05;       ///< accepted CutDecomposition::error, > 0
  std::size_t max_parts = 64;  ///< greatest number of parts, >= 1; has priority over `max_error`
  /// If more parts than this are found, a smaller set with the accepted error is searched for.
  std::size_t enough_parts = 64;
};

struct CutDecomposition {
  std::vector<ConvexPolyhedron> parts;
  /// Volume in which each part differs from its piece of the solid, summed over the parts, as a fraction of
  /// the volume: an upper bound of the volume in which all parts together differ from the solid.
  Real error = 0;
};

/// Decomposes several solids together. Each must have a positive volume; they may touch or overlap each
/// other. It first tries to reach the error with few parts, and then with as many parts as allowed. The
/// result does not depend on the number of threads.
CutDecomposition decompose_by_cuts(std::span<const SolidPiece> solids, const CutGoal& goal);

}  // namespace offstage::sim
