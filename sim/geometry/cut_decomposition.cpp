#include "sim/geometry/cut_decomposition.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <tbb/parallel_for.h>

#include "sim/geometry/cut_search.h"
#include "sim/geometry/hull_merge.h"
#include "sim/geometry/hull_trim.h"
#include "sim/geometry/voronoi_pieces.h"

namespace offstage::sim {
namespace {

/// Distances below this fraction of the solid's diagonal count as zero.
constexpr Real kOnCutPlane = 2e-7;
/// Trimming moves faces by at most this fraction of the solid's diagonal.
constexpr Real kTrim = 0.02;
/// Before merging, the solids are cut into more pieces than the wanted number of parts. kMorePieces is the
/// factor for cuts of whole solids, kMoreCells for cuts of Voronoi cells.
constexpr Real kMorePieces = 1.5, kMoreCells = 1.25;
/// Excess of the hulls' volume at which cutting ends, and at which merging ends, in multiples of the accepted
/// error. Trimming removes a part of the excess; only a trial shows how much.
constexpr Real kCutTo = 0.7;
constexpr std::array<Real, 3> kMergeTo = {2, 1.4, 1};
/// Number of bisection steps between two values of kMergeTo while there are more parts than necessary.
constexpr int kTrials = 3;

class SolidCutter {
 public:
  SolidCutter(std::span<const SolidPiece> solids, const CutGoal& goal) : solids_(solids), goal_(goal) {
    Aabb box;
    for (const SolidPiece& solid : solids) {
      for (const Vec3& p : solid.points) box.extend(p);
      whole_ += moments(solid).volume;
      for (const ReflexEdge& e : sharp_reflex_edges(solid)) reflex_.push_back(e);
    }
    diagonal_ = box.diagonal().norm();
    tolerance_ = kOnCutPlane * diagonal_;
  }

  CutDecomposition run() const {
    std::vector<HulledPiece> pieces;
    for (uint32_t k = 0; k < solids_.size(); ++k) pieces.push_back(with_hull(solids_[k], k));
    cut_worst(pieces, kMorePieces);
    CutDecomposition few = merged(pieces);
    if (few.error <= goal_.max_error || goal_.max_parts < 2) return few;
    std::vector<HulledPiece> cells = voronoi_cells();
    cut_worst(cells, kMoreCells);
    CutDecomposition many = merged(cells);
    return few.parts.empty() || many.error < few.error ? many : few;
  }

 private:
  /// Returns Voronoi cells of all solids. The number of cells of a solid is proportional to the area of its
  /// surface.
  std::vector<HulledPiece> voronoi_cells() const {
    std::vector<Real> areas;
    Real total = 0;
    for (const SolidPiece& solid : solids_) total += areas.emplace_back(surface_area(solid));
    std::vector<HulledPiece> cells;
    for (uint32_t k = 0; k < solids_.size(); ++k) {
      const Real fraction = areas[k] / total * static_cast<Real>(goal_.max_parts);
      const auto count = static_cast<std::size_t>(std::max(1.0, std::floor(fraction)));
      std::vector<SolidPiece> made =
          voronoi_pieces(solids_[k], spread_centres(solids_[k], count), tolerance_);
      const std::size_t first = cells.size();
      cells.resize(first + made.size());
      tbb::parallel_for(std::size_t{0}, made.size(),
                        [&](std::size_t i) { cells[first + i] = with_hull(std::move(made[i]), k); });
    }
    return cells;
  }

  /// Repeatedly cuts the piece with the largest excess. It ends when the excess of all pieces is small, or
  /// there are `factor` times as many pieces as wanted parts.
  void cut_worst(std::vector<HulledPiece>& pieces, Real factor) const {
    const Real wanted = static_cast<Real>(goal_.max_parts), accepted = goal_.max_error * whole_;
    while (static_cast<Real>(pieces.size()) < factor * wanted) {
      Real excess = 0;
      for (const HulledPiece& p : pieces) excess += p.excess;
      if (excess <= kCutTo * accepted) break;
      const auto worst =
          std::max_element(pieces.begin(), pieces.end(),
                           [](const HulledPiece& a, const HulledPiece& b) { return a.excess < b.excess; });
      const auto plane = best_cut(*worst, reflex_, tolerance_);
      if (!plane) break;
      std::array<SolidPiece, 2> halves = cut(worst->solid, *plane, tolerance_);
      std::array<HulledPiece, 2> both;
      tbb::parallel_for(std::size_t{0}, std::size_t{2},
                        [&](std::size_t k) { both[k] = with_hull(std::move(halves[k]), worst->solid_id); });
      *worst = std::move(both[0]);
      pieces.push_back(std::move(both[1]));
    }
    std::erase_if(pieces, [](const HulledPiece& p) { return p.hull.dimension() < 3; });
  }

  /// Merges pieces. Returns the decomposition with the fewest parts whose error is accepted; if there is
  /// none, the decomposition with the smallest error.
  CutDecomposition merged(const std::vector<HulledPiece>& pieces) const {
    std::vector<HullToMerge> hulls;
    Real excess = 0;
    for (const HulledPiece& p : pieces) {
      hulls.push_back({p.hull, p.solid_id});
      excess += p.excess;
    }
    const HullMerger merger(hulls);
    const auto merge = [&](Real merge_to) {
      const Real budget = std::max(0.0, merge_to * goal_.max_error * whole_ - excess);
      return merger.run(goal_.max_parts, budget);
    };
    CutDecomposition result;
    std::size_t count = 0;
    Real missed = 0, reached = 0;  // as multiples of the accepted error
    for (Real merge_to : kMergeTo) {
      std::vector<MergedHull> parts = merge(merge_to);
      // A smaller budget ends the same mergers earlier.
      if (parts.size() == count) continue;
      count = parts.size();
      result = trimmed_parts(pieces, std::move(parts));
      if (result.error <= goal_.max_error) {
        reached = merge_to;
        break;
      }
      missed = merge_to;
    }
    if (missed == 0 || reached == 0) return result;
    for (int trial = 0; trial < kTrials && result.parts.size() > goal_.enough_parts; ++trial) {
      const Real merge_to = (missed + reached) / 2;
      CutDecomposition fewer = trimmed_parts(pieces, merge(merge_to));
      const bool is_good = fewer.error <= goal_.max_error;
      (is_good ? reached : missed) = merge_to;
      if (is_good) result = std::move(fewer);
    }
    return result;
  }

  CutDecomposition trimmed_parts(const std::vector<HulledPiece>& pieces,
                                 std::vector<MergedHull> parts) const {
    std::vector<TrimmedHull> done(parts.size());
    tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t k) {
      std::vector<const SolidPiece*> members;
      for (uint32_t m : parts[k].members) members.push_back(&pieces[m].solid);
      done[k] = trimmed(std::move(parts[k].hull), members, parts[k].shared, kTrim * diagonal_);
    });
    CutDecomposition result;
    for (TrimmedHull& t : done) {
      result.parts.push_back(std::move(t.hull));
      result.error += t.error / whole_;
    }
    return result;
  }

  std::span<const SolidPiece> solids_;
  CutGoal goal_;
  Real whole_ = 0, diagonal_ = 0, tolerance_ = 0;
  std::vector<ReflexEdge> reflex_;
};

}  // namespace

CutDecomposition decompose_by_cuts(std::span<const SolidPiece> solids, const CutGoal& goal) {
  return SolidCutter(solids, goal).run();
}

}  // namespace offstage::sim
