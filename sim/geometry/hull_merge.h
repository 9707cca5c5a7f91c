#pragma once
/// Merging of convex parts, at the price of some additional volume.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sim/geometry/convex_polyhedron.h"

namespace offstage::sim {

/// Volume of a convex polyhedron; 0 if it is flat. [m^3]
Real hull_volume(const ConvexPolyhedron& p);

/// The common hull of some of the given parts.
struct MergedHull {
  ConvexPolyhedron hull;
  std::vector<uint32_t> members;  ///< indices of the parts
  Real shared = 0;  ///< volume that lies in several of the parts, if these belong to different solids [m^3]
};

/// A part before the merger.
struct HullToMerge {
  ConvexPolyhedron hull;
  uint32_t solid = 0;  ///< parts of one solid do not overlap much; parts of different solids may
};

/// Merges convex parts; run() can be called several times, with different bounds.
class HullMerger {
 public:
  /// `parts` must outlive this object.
  explicit HullMerger(std::span<const HullToMerge> parts);
  ~HullMerger();

  /// Replaces two parts by their common hull, those with the least additional volume first, while there are
  /// more than `max_parts` and then while all additional volumes together are at most `budget` [m^3]. Parts
  /// whose boxes are separate are merged last.
  std::vector<MergedHull> run(std::size_t max_parts, Real budget) const;

 private:
  class Mergers;
  std::span<const HullToMerge> parts_;
  std::unique_ptr<const Mergers> start_;
};

}  // namespace offstage::sim
