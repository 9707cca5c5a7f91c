#pragma once
/// Decomposition of solids into convex parts (physics N8). Exact: reflex edges are resolved by cut planes
/// after Joe, "Tetrahedral mesh generation in polyhedral regions based on convex polyhedron decompositions"
/// (1994), in the simplified form of the book's appendix F. Where this is not possible (open or non-manifold
/// scans, cavities, surfaces that intersect themselves, too many reflex edges or cuts) the solid is
/// approximated by convex hulls of its parts in boxes, and the result states the reason.

#include <cstdint>
#include <string>
#include <vector>

#include "sim/geometry/convex_polyhedron.h"
#include "sim/geometry/mesh.h"

namespace offstage::sim {

/// How a solid is decomposed.
enum class DecompositionMethod : uint8_t {
  automatic,    ///< exact where that is possible, else approximate
  approximate,  ///< hulls of the parts of the solid
  hull,         ///< one part: the convex hull
};

struct DecompositionSettings {
  DecompositionMethod method = DecompositionMethod::automatic;
  /// Smallest angle between a cut and the faces that it meets [rad]; relaxed if no cut satisfies it.
  Real min_dihedral = 0.35;
  /// Smallest distance of a cut from vertices off it, as a share of the mean edge. Relaxed if no cut
  /// satisfies it.
  Real min_distance = 0.1;
  uint32_t max_reflex_edges = 2000;  ///< with more reflex edges the solid is approximated at once
  /// Accepted volume error of an approximate decomposition, and its greatest number of parts, which may
  /// prevent that. A thin curved shell takes the most parts: hulls of n equal patches of half a sphere of
  /// radius r and thickness t are about r / (n t) too large, as a share of its volume.
  Real max_error = 0.05;
  uint32_t max_parts = 512;
  /// Number of lines along the longest side, along which an approximate decomposition samples the solid.
  uint32_t resolution = 128;

  bool operator==(const DecompositionSettings&) const = default;
};

struct ConvexDecomposition {
  enum class Method : uint8_t {
    convex,       ///< the solid was convex: one part
    exact,        ///< cut along reflex edges: the parts fill the solid
    approximate,  ///< hulls of the solid's parts between cut planes; `note` has the reason
    none,         ///< the surface has no inside: no parts
  };
  Method method = Method::none;
  std::vector<ConvexPolyhedron> parts;
  /// |sum of the parts - solid| / solid; for open meshes relative to the volume of the voxels.
  Real volume_error = 0;
  std::string note;  ///< reason why the method is approximate or none; otherwise empty
};

/// Decomposes a welded mesh with finite coordinates; it may be inside out. The result does not depend on the
/// number of threads. Parts of the exact method do not overlap, and their volumes sum to that of the solid
/// within 1e-6. Faces that are flat within 2e-7 of the mesh's diagonal count as flat. Takes at most one or
/// two seconds for meshes of up to 100 000 faces.
ConvexDecomposition decompose(const TriangleMesh& mesh, const MeshTopology& topology,
                              const DecompositionSettings& settings = {});

}  // namespace offstage::sim
