// Finite coordinates of any size as points of a convex hull.

#include <cmath>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "sim/core/types.h"
#include "sim/geometry/convex_hull.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace offstage::sim;
  constexpr size_t kMostPoints = 64;
  std::vector<Vec3> points;
  for (size_t at = 0; at + sizeof(Vec3) <= size && points.size() < kMostPoints; at += sizeof(Vec3)) {
    Vec3 point;
    std::memcpy(point.data(), data + at, sizeof point);
    if (point.allFinite()) points.push_back(point);
  }
  if (points.empty()) return 0;
  try {
    const ConvexPolyhedron hull = convex_hull(points);
    if (hull.vertices().empty()) __builtin_trap();
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
