/// Convex decomposition of L, U, cross, star prisms, a bowl: volumes sum, all parts are convex
/// (validation.md).

#include <gtest/gtest.h>

#include "sim/geometry/convex_decomposition.h"
#include "sim/geometry/mass_properties.h"
#include "tests/solids.h"

namespace offstage::sim {
namespace {

TEST(DecompositionValidation, VolumesSumAndPartsAreConvex) {
  const TriangleMesh solids[] = {l_solid(),
                                 u_solid(),
                                 cross_solid(),
                                 jack_solid(),
                                 star_prism(5, 1, 0.4, 0.5),
                                 star_prism(9, 1, 0.6, 2),
                                 bowl(1, 0.8, 16, 5)};
  for (std::size_t k = 0; k < std::size(solids); ++k) {
    SCOPED_TRACE(k);
    const TriangleMesh mesh = placed_at_random(solids[k], 1, k);
    const ConvexDecomposition d = decompose(mesh, MeshTopology(mesh), {.method = DecompositionMethod::exact});
    EXPECT_EQ(d.method, ConvexDecomposition::Method::exact) << d.note;
    Real sum = 0;
    for (const ConvexPolyhedron& p : d.parts) {
      sum += mass_properties(p.triangles()).volume;
      EXPECT_LE(concavity(p), 1e-9);
    }
    EXPECT_NEAR(sum / mass_properties(mesh).volume, 1, 1e-6);
  }
}

}  // namespace
}  // namespace offstage::sim
