#pragma once
/// Distance between convex solids by the algorithm of Gilbert, Johnson and Keerthi (1988), physics R4. It
/// finds the point of the Minkowski difference A - B that is nearest to the origin with a sequence of
/// simplices. The distance sub-algorithm is by Montanari, Petrinic, Barbieri, "Improving the GJK algorithm
/// for faster and more reliable distance queries between convex objects" (2017). Support points of polyhedra
/// are found by climbing from the last vertex, and a query starts from the simplex of the last query.

#include <array>
#include <cstdint>

#include "sim/collision/convex.h"
#include "sim/collision/minkowski.h"
#include "sim/collision/separation.h"

namespace offstage::sim {

/// Final state of the last query of a pair; empty before the first one. Any content is safe: it affects only
/// the speed of the query, not its result, except for rounding and the choice between equivalent results.
struct GjkCache {
  uint32_t size = 0;                 ///< size of the simplex in `from`; not used with curved cores
  std::array<VertexPair, 4> from{};  ///< vertices of the simplex, also the start of the support climb
  Vec3 direction = Vec3::Zero();     ///< last normal, in A's frame; zero before the first query
};

/// Returns the signed distance of A and B. For cores with vertices the result is exact up to rounding. If a
/// core is round, such as a cylinder or a cone, the error is at most 1e-12 of the size for separate solids.
/// In penetration it is at most 1e-10; about 0.5 % of these cases are slightly worse, and `converged` is then
/// false. Cores that overlap or touch are passed to deepest_point(), which returns the normal of a face of A
/// - B. So the normal is reliable even if the solids barely touch.
Separation gjk(const Convex& a, const Convex& b, const Pose& a_from_b, GjkCache& cache);

/// Returns the depth and the direction of the smallest translation that separates two solids, which must
/// overlap.
Separation penetration(const Convex& a, const Convex& b, const Pose& a_from_b);

/// Whether A and B have a point in common. It is faster than gjk(), because it ends at the first separating
/// direction.
bool overlap(const Convex& a, const Convex& b, const Pose& a_from_b, GjkCache& cache);

}  // namespace offstage::sim
