#pragma once
/// The solids that a mesh bounds, also a mesh with holes or edges of many faces, for the approximate convex
/// decomposition.

#include <cstdint>
#include <vector>

#include "sim/geometry/mesh.h"
#include "sim/geometry/solid_piece.h"

namespace offstage::sim {

/// The connected pieces of a surface without border; all in one if one of them is inside out, which is a
/// cavity of another, or if there are more than `most`. The net number of faces along each edge must be zero.
std::vector<SolidPiece> solids_of_closed(const TriangleMesh& mesh, std::size_t most);

/// The solid of a mesh that is not closed; empty if the surface has no inside. Holes are closed by fans of
/// triangles around their middle. If that changes the volume much, as for a bag, the solid consists of the
/// voxels that the surface surrounds by generalized winding numbers, `resolution` along the longest side.
/// The result does not depend on the number of threads.
std::vector<SolidPiece> solids_of_open(const TriangleMesh& mesh, uint32_t resolution);

}  // namespace offstage::sim
