#pragma once
/// Creates cloths of fabrics: rectangles of woven cells, and arbitrary triangle meshes (physics F6, F8). The
/// results are plain definitions; the caller may add pins, seams, tearing and pressure.

#include <cstdint>
#include <utility>

#include "effects/fabric.h"
#include "sim/cloth/cloth.h"

namespace offstage::effects {

using sim::Vec3;

struct GridSize {
  Real width = 1, height = 1;        ///< [m], > 0
  uint32_t columns = 20, rows = 20;  ///< number of cells, 1 to 1000 each
};

/// Returns the index of a vertex of a grid. In the pose's frame, the grid is in the plane y = 0 with the
/// normal +y. Columns increase along x from -width/2, rows increase along z from -height/2.
inline uint32_t grid_vertex(const GridSize& size, uint32_t column, uint32_t row) {
  return row * (size.columns + 1) + column;
}

/// Creates a rectangle of cells, each of two triangles whose diagonals alternate. Stretch springs are along
/// the threads, shear springs along both diagonals of each cell, and bend springs connect second neighbours.
/// Throws std::invalid_argument for a size or a fabric out of range.
sim::ClothDef grid_cloth(const GridSize& size, const sim::Pose& pose, const Fabric& fabric);

/// Creates a cloth from any triangle mesh, with stretch springs along its edges and bend springs between the
/// vertices opposite an edge. Vertices at the same position are merged by weld(), unless `keep_vertices` is
/// true, which keeps the vertex indices.
sim::ClothDef mesh_cloth(const sim::TriangleMesh& mesh, const sim::Pose& pose, const Fabric& fabric,
                         bool keep_vertices = false);

/// Creates a closed sphere around the pose's origin from an icosahedron whose triangles are divided into four
/// `divisions` times, 0 to 6: 10 * 4^divisions + 2 vertices. Normals point out.
sim::ClothDef sphere_cloth(Real radius, uint32_t divisions, const sim::Pose& pose, const Fabric& fabric);

/// A cord between a vertex of a cloth and a point: masses and springs in a row. With one segment it is a
/// spring, which also resists compression; with more segments it buckles under compression.
struct Cord {
  uint32_t vertex = 0;           ///< index of a vertex of the cloth
  Vec3 end = Vec3::Zero();       ///< position of the other end at the start, world [m]
  Real length = 0;               ///< length at rest [m]; 0: the distance of the ends
  uint32_t segments = 10;        ///< 1 to 1000
  Real stiffness = 50;           ///< force at a strain of 1 [N], > 0
  Real mass_per_length = 0.002;  ///< [kg/m], > 0
  Real damping = 0.1;            ///< fraction of the critical damping of each spring, >= 0
};
/// Adds a cord to a cloth and returns the index of its last vertex, for a pin. A cord that is longer than the
/// distance of its ends initially has the shape of a V: two straight parts of equal length that sag towards
/// -Y as far as the ends allow. Throws std::invalid_argument for a value out of range.
uint32_t add_cord(sim::ClothDef& def, const Cord& cord);

}  // namespace offstage::effects
