#pragma once
/// Makes cloths of fabrics: rectangles of woven cells and any triangle mesh (physics F6, F8). What they
/// return is a plain definition, to which pins, seams, tearing and pressure are added.

#include <cstdint>
#include <utility>

#include "effects/fabric.h"
#include "sim/cloth/cloth.h"

namespace offstage::effects {

struct GridSize {
  Real width = 1, height = 1;        ///< [m], > 0
  uint32_t columns = 20, rows = 20;  ///< cells, 1 to 1000 each
};

/// Vertex of a grid: columns go along x from -width/2, rows along z from -height/2 of the pose's frame, in
/// whose y = 0 it lies; its normal is +y.
inline uint32_t grid_vertex(const GridSize& size, uint32_t column, uint32_t row) {
  return row * (size.columns + 1) + column;
}

/// A rectangle of cells, each of two triangles whose diagonals alternate. Stretch springs along the threads,
/// shear springs across both diagonals of each cell, bend springs to second neighbours.
/// Throws std::invalid_argument for a size or a fabric out of range.
sim::ClothDef grid_cloth(const GridSize& size, const sim::Pose& pose, const Fabric& fabric);

/// Any triangle mesh: stretch springs along its edges, bend springs between the vertices opposite an edge.
/// Vertices at the same place are joined (weld) unless `keep_vertices`: then vertex i stays vertex i.
sim::ClothDef mesh_cloth(const sim::TriangleMesh& mesh, const sim::Pose& pose, const Fabric& fabric,
                         bool keep_vertices = false);

}  // namespace offstage::effects
