#pragma once
/// Creates cloths of fabrics: rectangles of woven cells, and arbitrary triangle meshes (physics F6, F8). The
/// results are plain definitions, to which pins, seams, tearing and pressure are added.

#include <cstdint>
#include <utility>

#include "effects/fabric.h"
#include "sim/cloth/cloth.h"

namespace offstage::effects {

struct GridSize {
  Real width = 1, height = 1;        ///< [m], > 0
  uint32_t columns = 20, rows = 20;  ///< number of cells, 1 to 1000 each
};

/// Index of a vertex of a grid. Columns are along x from -width/2 and rows along z from -height/2 of the
/// pose's frame, in the plane y = 0 with the normal +y.
inline uint32_t grid_vertex(const GridSize& size, uint32_t column, uint32_t row) {
  return row * (size.columns + 1) + column;
}

/// Creates a rectangle of cells, each of two triangles whose diagonals alternate. Stretch springs are along
/// the threads, shear springs along both diagonals of each cell, and bend springs connect second neighbours.
/// Throws std::invalid_argument for a size or a fabric out of range.
sim::ClothDef grid_cloth(const GridSize& size, const sim::Pose& pose, const Fabric& fabric);

/// Creates a cloth from any triangle mesh: stretch springs along its edges, bend springs between the vertices
/// opposite an edge. Vertices at the same position are merged (weld) unless `keep_vertices`; then the indices
/// of vertices do not change.
sim::ClothDef mesh_cloth(const sim::TriangleMesh& mesh, const sim::Pose& pose, const Fabric& fabric,
                         bool keep_vertices = false);

}  // namespace offstage::effects
