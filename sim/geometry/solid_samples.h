#pragma once
/// The inside of a solid, sampled along parallel lines.

#include <cstdint>
#include <vector>

#include "sim/geometry/mesh.h"

namespace offstage::sim {

struct SolidSamples {
  /// A piece of a line that is inside.
  struct Segment {
    Vec3 low, high;
  };
  std::vector<Segment> segments;
  Real line_area = 0;     ///< area of a cross section that one line stands for [m^2]
  bool overlaps = false;  ///< whether the surface winds around a point more than once

  Real volume() const;
};

/// Samples the inside of a mesh along its shortest side, by lines at distances of its longest side divided by
/// `resolution`. A closed mesh must have its faces outwards; its samples end exactly on the surface. The
/// inside of an open one is where the generalized winding number is above 1/2, on either side, at points of
/// twice that distance; there are no samples if the surface encloses nothing. The result does not depend on
/// the number of threads.
SolidSamples sample_solid(const TriangleMesh& mesh, bool is_closed, uint32_t resolution);

}  // namespace offstage::sim
