#pragma once
/// Approximate convex decomposition of any surface that has an inside, by cut planes chosen for the volume of
/// the hulls on both sides. Like V-HACD (Mamou and Ghorbel, "A simple and efficient approach for 3D mesh
/// approximate convex decomposition", 2009) and CoACD (Wei et al., "Approximate convex decomposition for 3D
/// meshes with collision-aware concavity and tree search", 2022) it divides the part with the greatest
/// concavity first. In contrast to both, the planes also follow the principal axes of each part and its flat
/// sides, because the parts of rings, coils and shells lie at all angles; and the parts are hulls of the
/// surface itself between the planes, so flat and slanted sides stay smooth.

#include <vector>

#include "sim/geometry/convex_polyhedron.h"
#include "sim/geometry/mesh.h"
#include "sim/geometry/solid_samples.h"

namespace offstage::sim {

struct CutGoal {
  Real volume = 0;          ///< of the solid [m^3], > 0
  Real max_error = 0.05;    ///< accepted excess of the hulls' volume, as a share
  uint32_t max_parts = 64;  ///< > 0
};

/// Divides a solid. `samples` are those of the mesh. Stops when the hulls' volume exceeds the solid's by at
/// most `max_error`, and merges parts as far as this allows. With more than `max_parts`, the parts that add
/// least volume are merged. The result does not depend on the number of threads.
std::vector<ConvexPolyhedron> decompose_by_cuts(const TriangleMesh& mesh, bool is_closed,
                                                const SolidSamples& samples, const CutGoal& limits);

}  // namespace offstage::sim
