#include "sim/geometry/convex_decomposition.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "sim/geometry/convex_hull.h"
#include "sim/geometry/cut_decomposition.h"
#include "sim/geometry/hull_merge.h"
#include "sim/geometry/joe_decomposition.h"
#include "sim/geometry/mass_properties.h"
#include "sim/geometry/polyhedron.h"
#include "sim/geometry/solid_samples.h"
#include "sim/geometry/winding_number.h"

namespace offstage::sim {
namespace {

/// Distances below this share of a mesh's diagonal count as zero. Files store coordinates in single
/// precision, so faces that were modelled flat are flat within 1e-7.
constexpr Real kSamePlace = 2e-7;
/// Accepted difference between the volume of the exact parts and that of the solid, as a share.
constexpr Real kExact = 1e-6;

using Method = ConvexDecomposition::Method;

Real relative_error(const std::vector<ConvexPolyhedron>& parts, Real volume) {
  Real sum = 0;
  for (const ConvexPolyhedron& p : parts) sum += hull_volume(p);
  return std::abs(sum - volume) / volume;
}

/// The parts of the exact method, or the reason why there are none.
struct ExactResult {
  std::vector<ConvexPolyhedron> parts;
  std::string failure;
};

ExactResult failed(std::string why) {
  return {{}, std::move(why)};
}

/// Returns the reason why a surface cannot be decomposed exactly, or an empty string.
std::string obstacle(const std::vector<Polyhedron>& shells, uint32_t max_reflex_edges) {
  uint32_t reflex = 0;
  for (const Polyhedron& shell : shells) {
    if (signed_volume6(shell) < 0) return "a cavity inside";
    reflex += count_reflex_edges(shell);
  }
  if (reflex <= max_reflex_edges) return {};
  return std::to_string(reflex) + " reflex edges, more than " + std::to_string(max_reflex_edges);
}

ExactResult decompose_exactly(const TriangleMesh& mesh, const MeshTopology& topology, Real volume,
                              const DecompositionSettings& settings) {
  Aabb box;
  for (const Vec3& v : mesh.vertices) box.extend(v);
  const Real tolerance = kSamePlace * box.diagonal().norm();
  std::vector<Polyhedron> shells = boundaries(mesh, topology, tolerance);
  if (std::string why = obstacle(shells, settings.max_reflex_edges); !why.empty()) return failed(why);

  const JoeResult cut =
      resolve_reflex_edges(std::move(shells), {settings.min_dihedral, settings.min_distance}, tolerance);
  if (cut.parts.empty()) return failed(cut.failure);
  ExactResult result;
  for (const Polyhedron& p : cut.parts) {
    result.parts.push_back(convex_hull(p.points));
    if (result.parts.back().dimension() < 3) result.parts.pop_back();
  }
  // The hull of a part is larger than the part unless the part is convex, so equal volumes prove that all are
  // convex.
  if (!(relative_error(result.parts, volume) <= kExact))
    return failed("the cuts are inexact because of rounding");
  const WindingNumber winding(mesh);
  for (const ConvexPolyhedron& p : result.parts)
    if (winding.at(p.centre()) > 1.5) return failed("the surface overlaps itself");
  return result;
}

/// Returns the same surface with faces reversed, for a positive volume.
TriangleMesh turned_over(TriangleMesh mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

/// `volume`: of a closed mesh. It counts overlapping parts of a surface twice; the samples do not.
ConvexDecomposition decompose_approximately(const TriangleMesh& mesh, std::optional<Real> volume,
                                            const DecompositionSettings& settings, const std::string& why) {
  const SolidSamples samples = sample_solid(mesh, volume.has_value(), settings.resolution);
  const Real inside = volume && !samples.overlaps ? *volume : samples.volume();
  if (!(inside > 0)) return {Method::none, {}, 0, "the surface encloses nothing: " + why};
  std::vector<ConvexPolyhedron> parts =
      decompose_by_cuts(mesh, volume.has_value(), samples, {inside, settings.max_error, settings.max_parts});
  if (parts.empty()) return {Method::none, {}, 0, "the surface encloses nothing: " + why};
  const Real error = relative_error(parts, inside);
  return {Method::approximate, std::move(parts), error, why};
}

ConvexDecomposition hull_alone(const TriangleMesh& mesh, std::optional<Real> volume, uint32_t resolution) {
  ConvexPolyhedron hull = convex_hull(mesh.vertices);
  if (hull.dimension() < 3) return {Method::none, {}, 0, "the surface is flat"};
  const Real inside = volume ? *volume : sample_solid(mesh, false, resolution).volume();
  std::vector<ConvexPolyhedron> parts = {std::move(hull)};
  const Real error = inside > 0 ? relative_error(parts, inside) : 0;
  return {Method::approximate, std::move(parts), error, "\"method\" is hull"};
}

}  // namespace

ConvexDecomposition decompose(const TriangleMesh& mesh, const MeshTopology& topology,
                              const DecompositionSettings& settings) {
  if (mesh.triangles.empty()) return {Method::none, {}, 0, "no faces"};
  if (!topology.defects().closed()) {
    if (settings.method == DecompositionMethod::hull) return hull_alone(mesh, {}, settings.resolution);
    return decompose_approximately(mesh, {}, settings, topology.defects().describe());
  }
  if (topology.defects().inverted) {
    const TriangleMesh outward = turned_over(mesh);
    return decompose(outward, MeshTopology(outward), settings);
  }
  const Real volume = mass_properties(mesh).volume;
  if (!(volume > 0)) return {Method::none, {}, 0, "the surface encloses nothing"};
  if (settings.method == DecompositionMethod::hull) return hull_alone(mesh, volume, settings.resolution);
  if (settings.method == DecompositionMethod::approximate)
    return decompose_approximately(mesh, volume, settings, "\"method\" is approximate");
  ExactResult exact = decompose_exactly(mesh, topology, volume, settings);
  if (exact.parts.empty()) return decompose_approximately(mesh, volume, settings, exact.failure);
  const Real error = relative_error(exact.parts, volume);
  const Method method = exact.parts.size() == 1 ? Method::convex : Method::exact;
  return {method, std::move(exact.parts), error, {}};
}

}  // namespace offstage::sim
