#pragma once
/// Exact convex decomposition: reflex edges are resolved by cut planes, after Joe, "Tetrahedral mesh
/// generation in polyhedral regions based on convex polyhedron decompositions" (1994), as the book's appendix
/// F has it.

#include <string>
#include <vector>

#include "sim/geometry/polyhedron.h"

namespace offstage::sim {

/// What a cut must keep from a polyhedron, at first; relaxed in steps to nothing where no cut keeps it.
struct CutLimits {
  Real dihedral = 0;  ///< smallest angle between the cut and a face it meets [rad]
  Real distance = 0;  ///< of the cut from vertices next to it that are off it, share of the mean edge
};

/// Whether the dihedral angle at a half-edge is over pi.
bool is_reflex(const Polyhedron& p, uint32_t half_edge);
uint32_t count_reflex_edges(const Polyhedron& p);

struct JoeResult {
  std::vector<Polyhedron> parts;  ///< without reflex edges; none if it failed
  std::string failure;            ///< why; else empty
};

/// Cuts polyhedra into parts without reflex edges. Points within `tolerance` of a cut are taken to be on it.
JoeResult resolve_reflex_edges(std::vector<Polyhedron> polyhedra, const CutLimits& limits, Real tolerance);

}  // namespace offstage::sim
