#pragma once
/// Cutting solids into convex parts (physics N8). Exact: reflex edges are resolved by cut planes after Joe,
/// "Tetrahedral mesh generation in polyhedral regions based on convex polyhedron decompositions" (1994), in
/// the simplified form of the book's appendix F. Where that cannot be done (open or non-manifold scans,
/// cavities, surfaces that cover themselves, too many reflex edges or cuts) the solid is approximated by
/// hulls of boxfuls of it, and the result says so and why.

#include <cstdint>
#include <string>
#include <vector>

#include "sim/geometry/convex_polyhedron.h"
#include "sim/geometry/mesh.h"

namespace offstage::sim {

struct DecompositionSettings {
  Real min_dihedral = 0.35;  ///< of a cut against the faces it meets [rad]; relaxed where none keeps it
  Real min_distance = 0.1;   ///< of a cut from vertices off it, share of the mean edge; likewise
  uint32_t max_reflex_edges = 2000;  ///< more of them: approximate at once
  uint32_t max_parts = 32;           ///< of an approximate decomposition
  uint32_t resolution = 64;          ///< voxels along the longest side, of an approximate decomposition
};

struct ConvexDecomposition {
  enum class Method : uint8_t {
    convex,       ///< the solid was convex: one part
    exact,        ///< cut along reflex edges: the parts fill the solid
    approximate,  ///< hulls of boxfuls of the solid: see `note`
    none,         ///< a surface without inside: no parts
  };
  Method method = Method::none;
  std::vector<ConvexPolyhedron> parts;
  Real volume_error = 0;  ///< |sum of the parts - solid| / solid; of open meshes against the voxels' volume
  std::string note;       ///< why the method is approximate or none; else empty
};

/// Decomposes a welded mesh of finite coordinates, inside out or not. Deterministic, on any number of
/// threads. Parts of the exact method do not overlap and their volumes sum to the solid's within 1e-6; what
/// is flat within 2e-7 of the mesh's diagonal counts as flat. Takes a second or two at most but for meshes
/// beyond 100 000 faces.
ConvexDecomposition decompose(const TriangleMesh& mesh, const MeshTopology& topology,
                              const DecompositionSettings& settings = {});

}  // namespace offstage::sim
