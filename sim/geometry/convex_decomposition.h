#pragma once
/// Decomposition of solids into convex parts (physics N8). The exact method resolves reflex edges by cut
/// planes after Joe, "Tetrahedral mesh generation in polyhedral regions based on convex polyhedron
/// decompositions" (1994), in the simplified form of the book's appendix F. Where this is not possible (open
/// or non-manifold scans, cavities, surfaces that intersect themselves, too many parts) the solid is
/// approximated by convex hulls of its pieces between cut planes, and the result states the reason.

#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "sim/geometry/convex_polyhedron.h"
#include "sim/geometry/mesh.h"

namespace offstage::sim {

/// Method and limits of a decomposition.
enum class DecompositionMethod : uint8_t {
  automatic,    ///< exact if that takes at most `max_parts`, else approximate
  exact,        ///< exact with up to 1024 parts, else approximate
  approximate,  ///< hulls of pieces
  hull,         ///< one part: the convex hull
};

struct DecompositionSettings {
  DecompositionMethod method = DecompositionMethod::automatic;
  /// Smallest angle between an exact cut and the faces that it meets [rad], 20 degrees; relaxed if no cut
  /// satisfies it.
  Real min_dihedral = 20 * std::numbers::pi / 180;
  /// Smallest distance of an exact cut from vertices off it, as a fraction of the mean edge. The distance is
  /// reduced if no cut satisfies it.
  Real min_distance = 0.1;
  /// Greatest number of reflex edges for the exact method; a solid with more is approximated at once.
  uint32_t max_reflex_edges = 2000;
  Real max_error = 0.05;  ///< accepted error of an approximate decomposition, > 0
  /// Greatest number of approximate parts if these reach `max_error`; >= 1.
  uint32_t max_parts = 64;
  /// Greatest number of approximate parts in any case, >= max_parts. If max_parts are not sufficient for
  /// `max_error`, as for thin bent shells, up to this number of parts are created. The error may then still
  /// be greater than `max_error`.
  uint32_t most_parts = 1024;
  uint32_t resolution = 64;  ///< voxels along the longest side of a mesh with holes

  bool operator==(const DecompositionSettings&) const = default;
};

struct ConvexDecomposition {
  enum class Method : uint8_t {
    convex,       ///< the solid was convex: one part
    exact,        ///< cut along reflex edges: the parts fill the solid
    approximate,  ///< hulls of the solid's pieces; `note` has the reason
    none,         ///< the surface has no inside: no parts
    hull,         ///< the convex hull, as requested by the settings
  };
  Method method = Method::none;
  std::vector<ConvexPolyhedron> parts;
  /// |volume of the parts - volume of the solid| / volume of the solid.
  Real volume_error = 0;
  /// Upper bound of the volume in which the parts and the solid differ, as a fraction of the solid's volume;
  /// DecompositionSettings::max_error limits it. 0 for exact parts. For several surfaces that may overlap,
  /// this and `volume_error` are estimates with an accuracy of about 1 %.
  Real difference = 0;
  std::string note;  ///< reason why the method is approximate or none; otherwise empty
};

/// Decomposes a welded mesh with finite coordinates; the mesh may be inside out. The result does not depend
/// on the number of threads. Parts of the exact method do not overlap, and the sum of their volumes is the
/// volume of the solid within 1e-6. Faces that are flat within 2e-7 of the mesh's diagonal count as flat.
/// Approximate parts are trimmed, so they may omit features of the solid up to a depth of 2 % of its
/// diagonal.
ConvexDecomposition decompose(const TriangleMesh& mesh, const MeshTopology& topology,
                              const DecompositionSettings& settings = {});

}  // namespace offstage::sim
