#pragma once
/// Exact convex decomposition that removes reflex edges by cut planes, after Joe, "Tetrahedral mesh
/// generation in polyhedral regions based on convex polyhedron decompositions" (1994), as described in the
/// book's appendix F.

#include <string>
#include <vector>

#include "sim/geometry/polyhedron.h"

namespace offstage::sim {

/// Limits for a cut, and bounds of the method. If no cut satisfies the limits, they are relaxed in steps,
/// finally to zero.
struct CutLimits {
  Real dihedral = 0;  ///< smallest angle between the cut and a face it meets [rad]
  /// Smallest distance between the cut and vertices that are not on it, as a fraction of the mean edge
  /// length.
  Real distance = 0;
  // The method fails beyond these bounds.
  std::size_t max_parts = 1024;
  Real max_work = 5e7;  ///< bound of the work: the sum, over all tried planes, of the number of
                        ///< half-edges of the polyhedron to be cut
};

/// Whether the interior dihedral angle at a half-edge is greater than pi.
bool is_reflex(const Polyhedron& p, uint32_t half_edge);
uint32_t count_reflex_edges(const Polyhedron& p);

struct JoeResult {
  std::vector<Polyhedron> parts;  ///< parts without reflex edges; empty if it failed
  std::string failure;            ///< reason of the failure; otherwise empty
};

/// Returns the text for JoeResult::failure if there are more parts than `limits` allow.
std::string too_many_parts(const CutLimits& limits);

/// Cuts polyhedra into parts without reflex edges. Points within `tolerance` of a cut count as on it.
JoeResult resolve_reflex_edges(std::vector<Polyhedron> polyhedra, const CutLimits& limits, Real tolerance);

}  // namespace offstage::sim
