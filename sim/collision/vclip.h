#pragma once
/// Distance between convex polyhedra by the Voronoi Clip algorithm: Mirtich, "V-Clip: fast and robust
/// polyhedral collision detection" (1998), physics R4. The algorithm moves from one feature of a polyhedron
/// to a neighbouring feature, until each closest point lies in the Voronoi region of the other feature. If it
/// starts from the features of the last step, it needs only a few moves.

#include <cstdint>

#include "sim/collision/separation.h"
#include "sim/geometry/convex_polyhedron.h"

namespace offstage::sim {

struct Feature {
  enum class Kind : uint8_t { vertex, edge, face };
  Kind kind = Kind::vertex;
  uint32_t index = 0;
  friend bool operator==(const Feature&, const Feature&) = default;
};

/// The closest features of the last query of a pair. The first query may start from any features that the
/// polyhedra have.
struct VclipCache {
  Feature a, b;
};

/// Signed distance of two polyhedra that are not empty. On return `cache` has the closest features: two
/// vertices, a vertex and an edge or face, or two edges. For overlapping polyhedra it has the features at
/// which the overlap was found, and penetration() computes the result. Separation::iterations is the number
/// of visited pairs of features. If the walk enters a cycle because of rounding, gjk() computes the result.
Separation vclip(const ConvexPolyhedron& a, const ConvexPolyhedron& b, const Pose& a_from_b,
                 VclipCache& cache);

}  // namespace offstage::sim
