#pragma once
/// Approximate convex decomposition of any surface that has an inside, in the manner of V-HACD: Mamou and
/// Ghorbel, "A simple and efficient approach for 3D mesh approximate convex decomposition" (2009). The inside
/// is voxelised by winding numbers; boxes around it are halved where this reduces the volume of the hulls
/// most. In contrast to V-HACD, the parts are hulls of the surface itself within the boxes, so flat and
/// slanted sides stay smooth.

#include <vector>

#include "sim/geometry/convex_polyhedron.h"
#include "sim/geometry/mesh.h"

namespace offstage::sim {

struct VoxelDecomposition {
  std::vector<ConvexPolyhedron> parts;  ///< empty if no voxel is inside
  Real inside_volume = 0;               ///< volume of the voxels inside [m^3]
};

/// Decomposes a mesh with `resolution` voxels along its longest side. Stops when the hulls' volume is within
/// 1 % or there are `max_parts`. The result does not depend on the number of threads.
VoxelDecomposition decompose_by_voxels(const TriangleMesh& mesh, uint32_t resolution, uint32_t max_parts);

}  // namespace offstage::sim
