#pragma once
/// Distance between convex polyhedra by the Voronoi Clip algorithm: Mirtich, "V-Clip: fast and robust
/// polyhedral collision detection" (1998), physics R4. It walks from feature to neighbouring feature of both
/// polyhedra until each closest point lies in the other feature's Voronoi region; started from the last
/// step's features it ends almost at once.

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

/// The closest features of the last query of a pair; the first start anywhere. Any features that the
/// polyhedra have are safe to start from.
struct VclipCache {
  Feature a, b;
};

/// Signed distance of two polyhedra, neither of them empty, and in `cache` the features that have it: two
/// vertices, a vertex and an edge or face, or two edges. Those of overlapping polyhedra are where the walk
/// found that they do; penetration() then has the depth and the direction of the least translation.
/// `iterations` counts pairs of features. The walk never repeats a pair: where rounding would let it circle,
/// gjk() answers.
Separation vclip(const ConvexPolyhedron& a, const ConvexPolyhedron& b, const Pose& a_from_b,
                 VclipCache& cache);

}  // namespace offstage::sim
