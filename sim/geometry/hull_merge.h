#pragma once
/// Merging of convex parts into fewer hulls, which have some additional volume.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sim/geometry/convex_polyhedron.h"

namespace offstage::sim {

/// Returns the volume of a convex polyhedron, 0 if it is flat [m^3].
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
  uint32_t solid = 0;  ///< index of its solid; only parts of different solids may overlap much
};

/// Merges convex parts; run() can be called several times, with different bounds.
class HullMerger {
 public:
  /// `parts` must outlive this object.
  explicit HullMerger(std::span<const HullToMerge> parts);
  ~HullMerger();

  /// Repeatedly replaces two parts by their common hull. It chooses the two parts whose common hull adds the
  /// least volume. It continues while there are more than `max_parts` parts, and then as long as the sum of
  /// the additional volumes is at most `budget` [m^3]. Parts with separate bounding boxes are merged last.
  std::vector<MergedHull> run(std::size_t max_parts, Real budget) const;

 private:
  class Mergers;
  std::span<const HullToMerge> parts_;
  std::unique_ptr<const Mergers> start_;
};

}  // namespace offstage::sim
