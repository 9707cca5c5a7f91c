#include "sim/geometry/joe_decomposition.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "sim/geometry/polyhedron_cut.h"

namespace offstage::sim {
namespace {

/// Angles that differ by less than this are equal [rad].
constexpr Real kFlatFace = 1e-6;
/// Factors by which the limits on a cut are relaxed, tried in this order.
constexpr std::array<Real, 5> kRelaxed = {1, 0.5, 0.25, 0.1, 0};
/// Fractions of the dihedral angle at which cuts are tried, after the planes of neighbouring faces and edges
/// (F.2).
constexpr std::array<Real, 5> kFractions = {0.25, 0.5, 0.75, 0.375, 0.625};
constexpr std::size_t kMaxCandidates = 12;
/// Angles are rounded to multiples of this before they are ordered, so that rounding errors do not decide the
/// order of equal angles [rad].
constexpr Real kSameAngle = 1e-4;
/// Number of reflex edges with an acceptable cut that are compared before the best of their cuts is made.
constexpr int kCompared = 8;

Real mean_edge(const Polyhedron& p) {
  Real sum = 0;
  for (uint32_t h = 0; h < p.half_edges.size(); ++h) sum += (p.head_point(h) - p.origin_point(h)).norm();
  return sum / static_cast<Real>(p.half_edges.size());
}

/// Angles of the planes that split the wedge of a reflex edge into two convex wedges (physics F.2). The
/// planes are along the two faces, through neighbouring edges, and at fractions of the angle.
class Candidates {
 public:
  Candidates(const Polyhedron& p, uint32_t h, Real tolerance) : wedge_(wedge(p, h)) {
    add(std::numbers::pi);
    add(wedge_.angle - std::numbers::pi);
    for (uint32_t end : {h, p.half_edges[h].twin})
      p.for_each_leaving(end, [&](uint32_t k) {
        const Vec3 d = p.head_point(k) - p.origin_point(k);
        if (wedge_.along.cross(d).norm() <= tolerance) return;
        const Real theta = wedge_.angle_of(d);
        add(theta);
        add(theta < std::numbers::pi ? theta + std::numbers::pi : theta - std::numbers::pi);
      });
    for (Real fraction : kFractions) add(fraction * wedge_.angle);
  }

  const std::vector<Real>& angles() const { return angles_; }
  Vec3 plane_normal(Real theta) const { return wedge_.plane_normal(theta); }

 private:
  void add(Real theta) {
    if (theta < wedge_.angle - std::numbers::pi - kFlatFace || theta > std::numbers::pi + kFlatFace ||
        angles_.size() == kMaxCandidates)
      return;
    for (Real other : angles_)
      if (std::abs(other - theta) < kFlatFace) return;
    angles_.push_back(theta);
  }

  Wedge wedge_;
  std::vector<Real> angles_;
};

/// Quality of a cut.
struct Merit {
  int resolved = 0;  ///< number of reflex edges removed minus number of reflex edges cut in two
  Real dihedral = std::numeric_limits<Real>::infinity();  ///< smallest angle between the cut and a face [rad]
  Real distance = std::numeric_limits<Real>::infinity();  ///< distance of the nearest vertex off the cut [m]
};

/// Returns the distance from a plane to the nearest vertex that is not on it [m]. It limits how short the new
/// edges can be.
Real least_distance(const Polyhedron& p, const Polyhedron::Plane& plane, Real tolerance) {
  Real least = std::numeric_limits<Real>::infinity();
  for (const Vec3& v : p.points)
    if (const Real d = std::abs(plane.normal.dot(v) - plane.offset); d > tolerance)
      least = std::min(least, d);
  return least;
}

/// Returns the quality of a cut. Returns nothing if a side of the cut is not inside the solid, which only
/// rounding can cause.
std::optional<Merit> merit(const Polyhedron& p, const Cut& cut, Real tolerance) {
  Merit m;
  m.distance = least_distance(p, cut.plane, tolerance);
  for (std::size_t k = 0; k < cut.corners.size(); ++k) {
    const Cut::Corner &c = cut.corners[k], &next = cut.corners[(k + 1) % cut.corners.size()];
    const uint32_t left = p.half_edges[c.half_edge].face;
    const uint32_t right = c.across_face ? left : p.half_edges[p.half_edges[c.half_edge].twin].face;
    const Wedge inside(next.point - c.point, p.faces[left].plane.normal, p.faces[right].plane.normal);
    const Real above = inside.angle_of(cut.plane.normal.cross(inside.along)), below = inside.angle - above;
    m.dihedral = std::min({m.dihedral, above, below});
    if (!c.across_face && inside.angle > std::numbers::pi + kFlatFace &&
        std::max(above, below) <= std::numbers::pi + kFlatFace)
      ++m.resolved;
    if (c.on_edge && is_reflex(p, c.half_edge)) --m.resolved;
  }
  if (m.dihedral < kFlatFace) return {};
  return m;
}

struct RatedCut {
  Cut cut;
  Merit merit;
};

bool better(const Merit& a, const Merit& b) {
  return a.resolved != b.resolved ? a.resolved > b.resolved : a.dihedral > b.dihedral + kFlatFace;
}

class Decomposer {
 public:
  Decomposer(const CutLimits& limits, Real tolerance) : limits_(limits), tolerance_(tolerance) {}

  JoeResult run(std::vector<Polyhedron> rest) {
    JoeResult result;
    while (!rest.empty()) {
      Polyhedron p = std::move(rest.back());
      rest.pop_back();
      const std::vector<uint32_t> reflex = reflex_edges(p);
      if (reflex.empty()) {
        result.parts.push_back(std::move(p));
        continue;
      }
      const std::optional<RatedCut> best = best_cut(p, reflex);
      if (work_ > limits_.max_work) return {{}, "too many cuts"};
      if (result.parts.size() + rest.size() >= limits_.max_parts) return {{}, too_many_parts(limits_)};
      if (!best) return {{}, "no cut plane was found for a reflex edge"};
      for (Polyhedron& part : separate(std::move(p), best->cut)) rest.push_back(std::move(part));
    }
    return result;
  }

 private:
  /// Returns the reflex edges, in descending order of their angles. Cuts through sharp edges often resolve
  /// flatter ones, too.
  static std::vector<uint32_t> reflex_edges(const Polyhedron& p) {
    std::vector<std::pair<Real, uint32_t>> order;
    for (uint32_t h = 0; h < p.half_edges.size(); ++h)
      if (h < p.half_edges[h].twin && is_reflex(p, h))
        order.emplace_back(-std::floor(wedge(p, h).angle / kSameAngle), h);
    std::sort(order.begin(), order.end());
    std::vector<uint32_t> edges;
    for (const auto& [angle, h] : order) edges.push_back(h);
    return edges;
  }

  /// Returns the best cut of the first kCompared edges that have an acceptable cut. The limits are relaxed
  /// until an edge has one. The result is empty if there is no acceptable cut even then.
  std::optional<RatedCut> best_cut(const Polyhedron& p, const std::vector<uint32_t>& reflex) {
    const Real edge = mean_edge(p);
    std::optional<RatedCut> best;
    for (Real relaxed : kRelaxed) {
      int compared = 0;
      for (uint32_t h : reflex) {
        if (compared == kCompared || work_ > limits_.max_work) break;
        std::optional<RatedCut> cut = best_cut_at(p, h, relaxed, edge);
        if (!cut) continue;
        ++compared;
        if (!best || better(cut->merit, best->merit)) best = std::move(cut);
      }
      if (best) break;
    }
    return best;
  }

  std::optional<RatedCut> best_cut_at(const Polyhedron& p, uint32_t h, Real relaxed, Real edge) {
    std::optional<RatedCut> best;
    const Candidates candidates(p, h, tolerance_);
    for (Real theta : candidates.angles()) {
      const Vec3 normal = candidates.plane_normal(theta);
      work_ += static_cast<Real>(p.half_edges.size());
      std::optional<Cut> cut = trace_cut(p, h, {normal, normal.dot(p.origin_point(h))}, tolerance_);
      if (!cut) continue;
      const std::optional<Merit> m = merit(p, *cut, tolerance_);
      if (!m || m->dihedral < relaxed * limits_.dihedral || m->distance < relaxed * limits_.distance * edge)
        continue;
      if (!best || better(*m, best->merit)) best = RatedCut{std::move(*cut), *m};
    }
    return best;
  }

  CutLimits limits_;
  Real tolerance_, work_ = 0;
};

}  // namespace

bool is_reflex(const Polyhedron& p, uint32_t h) {
  const Real angle = wedge(p, h).angle;
  // The angle of a fin without thickness is 0 or, because of rounding, a full turn.
  return angle > std::numbers::pi + kFlatFace && angle < 2 * std::numbers::pi - kFlatFace;
}

uint32_t count_reflex_edges(const Polyhedron& p) {
  uint32_t n = 0;
  for (uint32_t h = 0; h < p.half_edges.size(); ++h) n += h < p.half_edges[h].twin && is_reflex(p, h);
  return n;
}

std::string too_many_parts(const CutLimits& limits) {
  return "more than " + std::to_string(limits.max_parts) + " exact parts";
}

JoeResult resolve_reflex_edges(std::vector<Polyhedron> polyhedra, const CutLimits& limits, Real tolerance) {
  return Decomposer(limits, tolerance).run(std::move(polyhedra));
}

}  // namespace offstage::sim
