#include "sim/geometry/convex_decomposition.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <tbb/parallel_for.h>

#include "sim/geometry/convex_hull.h"
#include "sim/geometry/cut_decomposition.h"
#include "sim/geometry/hull_merge.h"
#include "sim/geometry/joe_decomposition.h"
#include "sim/geometry/mass_properties.h"
#include "sim/geometry/polyhedron.h"
#include "sim/geometry/solid_of_mesh.h"
#include "sim/geometry/winding_number.h"

namespace offstage::sim {
namespace {

/// Distances below this fraction of a mesh's diagonal count as zero. Files store coordinates in single
/// precision, so faces that were modelled flat are flat within 1e-7.
constexpr Real kSamePlace = 2e-7;
/// Accepted difference between the total volume of the exact parts and the volume of the solid, as a fraction
/// of the solid's volume.
constexpr Real kExact = 1e-6;

/// Value of CutLimits::max_work if an approximate decomposition is accepted, too.
constexpr Real kQuickWork = 3e7;

/// Smallest factor by which the number of parts is increased if the error is too large.
constexpr Real kMoreParts = 1.25;

/// Number of points for estimated errors.
constexpr Real kErrorPoints = 3e4;

using Method = ConvexDecomposition::Method;

bool contains(const ConvexPolyhedron& part, const Vec3& p) {
  if (!part.box().contains(p)) return false;
  for (uint32_t f = 0; f < part.face_count(); ++f)
    if (part.plane(f).normal.dot(p) > part.plane(f).offset) return false;
  return true;
}

Real relative_error(const std::vector<ConvexPolyhedron>& parts, Real volume) {
  Real sum = 0;
  for (const ConvexPolyhedron& p : parts) sum += hull_volume(p);
  return std::abs(sum - volume) / volume;
}

/// The parts that the exact method found, or the reason why there are none.
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

CutLimits limits_of(const DecompositionSettings& settings) {
  CutLimits limits{settings.min_dihedral, settings.min_distance};
  if (settings.method != DecompositionMethod::exact) {
    limits.max_parts = settings.max_parts;
    limits.max_work = kQuickWork;
  }
  return limits;
}

TriangleMesh triangles_of(const Polyhedron& p) {
  TriangleMesh mesh{p.points, {}};
  for (uint32_t f = 0; f < p.faces.size(); ++f) {
    std::vector<uint32_t> corners;
    p.for_each_around(f, [&](uint32_t h) { corners.push_back(p.origin(h)); });
    for (std::size_t k = 1; k + 1 < corners.size(); ++k)
      mesh.triangles.push_back({corners[0], corners[k], corners[k + 1]});
  }
  return mesh;
}

TriangleMesh triangles_of(const SolidPiece& solid) {
  TriangleMesh mesh{solid.points, {}};
  for (std::size_t k = 0; k < solid.polygon_count(); ++k)
    for (uint32_t i = solid.first[k] + 1; i + 1 < solid.first[k + 1]; ++i)
      mesh.triangles.push_back({solid.corners[solid.first[k]], solid.corners[i], solid.corners[i + 1]});
  return mesh;
}

/// Appends the convex parts of one connected surface. Returns an empty string, or the reason why there are no
/// parts.
std::string add_exact_parts(Polyhedron shell, const CutLimits& limits, Real tolerance,
                            std::vector<ConvexPolyhedron>& parts) {
  const WindingNumber winding(triangles_of(shell));
  std::vector<Polyhedron> whole;
  whole.push_back(std::move(shell));
  const JoeResult cut = resolve_reflex_edges(std::move(whole), limits, tolerance);
  if (cut.parts.empty()) return cut.failure;
  for (const Polyhedron& p : cut.parts) {
    ConvexPolyhedron hull = convex_hull(p.points);
    if (hull.dimension() < 3) continue;
    if (winding.at(hull.centre()) > 1.5) return "the surface overlaps itself";
    parts.push_back(std::move(hull));
  }
  return {};
}

ExactResult decompose_exactly(const TriangleMesh& mesh, const MeshTopology& topology, Real volume,
                              const DecompositionSettings& settings) {
  Aabb box;
  for (const Vec3& v : mesh.vertices) box.extend(v);
  const Real tolerance = kSamePlace * box.diagonal().norm();
  std::vector<Polyhedron> shells = boundaries(mesh, topology, tolerance);
  if (std::string why = obstacle(shells, settings.max_reflex_edges); !why.empty()) return failed(why);
  const CutLimits limits = limits_of(settings);
  ExactResult result;
  for (Polyhedron& shell : shells) {
    CutLimits rest = limits;
    if (result.parts.size() >= limits.max_parts) return failed(too_many_parts(limits));
    rest.max_parts -= result.parts.size();
    if (std::string why = add_exact_parts(std::move(shell), rest, tolerance, result.parts); !why.empty())
      return failed(rest.max_parts < limits.max_parts && why == too_many_parts(rest) ? too_many_parts(limits)
                                                                                     : why);
  }
  // The hull of a part is larger than the part unless the part is convex, so equal volumes prove that all are
  // convex.
  if (!(relative_error(result.parts, volume) <= kExact))
    return failed("the cuts are inexact because of rounding");
  return result;
}

/// Returns the mesh with all faces reversed, which changes the sign of its volume.
TriangleMesh turned_over(TriangleMesh mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

ConvexDecomposition no_parts(std::string why) {
  ConvexDecomposition none;
  none.note = std::move(why);
  return none;
}

/// Whether the boxes of two of the solids intersect, so that the solids may overlap.
bool may_overlap(const std::vector<SolidPiece>& solids) {
  std::vector<Aabb> boxes(solids.size());
  for (std::size_t k = 0; k < solids.size(); ++k)
    for (const Vec3& p : solids[k].points) boxes[k].extend(p);
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (boxes[i].intersects(boxes[j])) return true;
  return false;
}

/// Whether points are inside a solid without caps.
struct BoundedWinding {
  explicit BoundedWinding(const SolidPiece& solid) : winding(triangles_of(solid)) {
    for (const Vec3& p : solid.points) box.extend(p);
  }
  bool contains(const Vec3& p) const { return box.contains(p) && winding.at(p) > 0.5; }

  WindingNumber winding;
  Aabb box;
};

/// Estimates the errors of a decomposition of solids that overlap. The errors computed before count common
/// volumes twice. The new errors compare the union of the solids with the union of the parts, at the points
/// of a regular grid.
void estimate_errors(const std::vector<SolidPiece>& solids, ConvexDecomposition& result) {
  Aabb box;
  for (const ConvexPolyhedron& part : result.parts) box.extend(part.box());
  std::vector<BoundedWinding> windings;
  for (const SolidPiece& solid : solids) {
    windings.emplace_back(solid);
    box.extend(windings.back().box);
  }
  const Real step = std::cbrt(box.volume() / kErrorPoints);
  const Eigen::Array3i counts = (box.sizes().array() / step).ceil().max(1).cast<int>();
  struct Count {
    int solid = 0, parts = 0, different = 0;
  };
  std::vector<Count> layers(static_cast<std::size_t>(counts.z()));
  tbb::parallel_for(0, counts.z(), [&](int z) {
    Count& count = layers[static_cast<std::size_t>(z)];
    for (int y = 0; y < counts.y(); ++y)
      for (int x = 0; x < counts.x(); ++x) {
        const Vec3 fraction((x + 0.5) / counts.x(), (y + 0.5) / counts.y(), (z + 0.5) / counts.z());
        const Vec3 p = box.min() + box.sizes().cwiseProduct(fraction);
        const bool in_solid = std::any_of(windings.begin(), windings.end(),
                                          [&](const BoundedWinding& w) { return w.contains(p); });
        const bool in_parts = std::any_of(result.parts.begin(), result.parts.end(),
                                          [&](const ConvexPolyhedron& part) { return contains(part, p); });
        count.solid += in_solid;
        count.parts += in_parts;
        count.different += in_solid != in_parts;
      }
  });
  Count all;
  for (const Count& c : layers) all = {all.solid + c.solid, all.parts + c.parts, all.different + c.different};
  if (all.solid == 0) return;
  result.volume_error = std::abs(static_cast<Real>(all.parts - all.solid)) / all.solid;
  result.difference = static_cast<Real>(all.different) / all.solid;
}

Real volume_of(const std::vector<SolidPiece>& solids) {
  Real volume = 0;
  for (const SolidPiece& solid : solids) volume += moments(solid).volume;
  return volume;
}

/// Returns parts with the accepted error, if at most `most_parts` parts are sufficient for it. A patch of a
/// shell of the thickness t whose sides are a and b along the principal curvatures k_a and k_b has a hull
/// that is larger by the fraction (|k_a| a^2 + |k_b| b^2) / (12 t), so the error is proportional to 1 / n for
/// n parts. docs/models.md has the least number of trimmed parts.
CutDecomposition cuts_within(const std::vector<SolidPiece>& solids, const DecompositionSettings& settings) {
  CutDecomposition best;
  for (Real count = settings.max_parts;;) {
    CutDecomposition cuts =
        decompose_by_cuts(solids, {settings.max_error, static_cast<std::size_t>(count), settings.max_parts});
    if (best.parts.empty() || cuts.error < best.error) best = std::move(cuts);
    if (best.parts.empty() || best.error <= settings.max_error || count >= settings.most_parts) return best;
    const Real expected = count * best.error / settings.max_error;
    count = std::min<Real>(settings.most_parts, std::ceil(std::max(kMoreParts * count, expected)));
  }
}

ConvexDecomposition decompose_approximately(const std::vector<SolidPiece>& solids,
                                            const DecompositionSettings& settings, const std::string& why) {
  const Real volume = volume_of(solids);
  if (!(volume > 0)) return no_parts("the surface encloses no volume: " + why);
  const CutDecomposition cuts = cuts_within(solids, settings);
  if (cuts.parts.empty()) return no_parts("the surface encloses no volume: " + why);
  const Real error = relative_error(cuts.parts, volume);
  ConvexDecomposition result{Method::approximate, cuts.parts, error, cuts.error, why};
  if (solids.size() > 1 && may_overlap(solids)) estimate_errors(solids, result);
  return result;
}

ConvexDecomposition hull_alone(const TriangleMesh& mesh, Real volume) {
  std::vector<ConvexPolyhedron> parts = {convex_hull(mesh.vertices)};
  if (parts[0].dimension() < 3) return no_parts("the surface is flat");
  const Real error = volume > 0 ? relative_error(parts, volume) : 0;
  return {Method::hull, std::move(parts), error, error, {}};
}

ConvexDecomposition decompose_open(const TriangleMesh& mesh, const DecompositionSettings& settings,
                                   const std::string& why) {
  const std::vector<SolidPiece> solids = solids_of_open(mesh, settings.resolution, settings.max_parts);
  if (settings.method == DecompositionMethod::hull) return hull_alone(mesh, volume_of(solids));
  return decompose_approximately(solids, settings, why);
}

}  // namespace

ConvexDecomposition decompose(const TriangleMesh& mesh, const MeshTopology& topology,
                              const DecompositionSettings& settings) {
  using Wanted = DecompositionMethod;
  if (mesh.triangles.empty()) return no_parts("the mesh has no faces");
  if (!topology.defects().closed()) return decompose_open(mesh, settings, topology.defects().describe());
  if (topology.defects().inverted) {
    const TriangleMesh outward = turned_over(mesh);
    return decompose(outward, MeshTopology(outward), settings);
  }
  const Real volume = mass_properties(mesh).volume;
  if (!(volume > 0)) return no_parts("the surface encloses no volume");
  if (settings.method == Wanted::hull) return hull_alone(mesh, volume);
  std::string why = "the approximate method was requested";
  if (settings.method != Wanted::approximate) {
    ExactResult exact = decompose_exactly(mesh, topology, volume, settings);
    if (!exact.parts.empty()) {
      const Real error = relative_error(exact.parts, volume);
      const Method method = exact.parts.size() == 1 ? Method::convex : Method::exact;
      return {method, std::move(exact.parts), error, 0, {}};
    }
    why = exact.failure;
  }
  return decompose_approximately(solids_of_closed(mesh, settings.max_parts), settings, why);
}

}  // namespace offstage::sim
