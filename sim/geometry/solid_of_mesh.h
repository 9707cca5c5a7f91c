#pragma once
/// Finds the solids that a mesh bounds, for the approximate convex decomposition. The mesh may have holes,
/// and edges with more than two faces.

#include <cstdint>
#include <vector>

#include "sim/geometry/mesh.h"
#include "sim/geometry/solid_piece.h"

namespace offstage::sim {

/// Returns one solid for each connected piece of a surface without borders. All pieces are one solid if a
/// piece is inside out (a cavity of another piece), or if there are more than `most` pieces. The net number
/// of faces along each edge must be zero.
std::vector<SolidPiece> solids_of_closed(const TriangleMesh& mesh, std::size_t most);

/// The solids of a mesh that is not closed, one for each of its connected pieces that has an inside; the
/// pieces are taken together if there are more than `most` or one is a cavity. Holes are closed by fans of
/// triangles around their middle. If this changes the volume of a piece much, for example of a bag, its solid
/// consists of the voxels that are inside according to generalized winding numbers, with a smoothed surface.
/// `resolution`: number of voxels along the longest side of the mesh. The result does not depend on the
/// number of threads.
std::vector<SolidPiece> solids_of_open(const TriangleMesh& mesh, uint32_t resolution, std::size_t most);

}  // namespace offstage::sim
