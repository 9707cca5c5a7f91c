// Arbitrary finite coordinates as the points of a convex hull and as a mesh for convex decomposition.

#include <cmath>
#include <cstring>
#include <stdexcept>

#include "sim/geometry/convex_decomposition.h"
#include "sim/geometry/convex_hull.h"
#include "sim/geometry/mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace offstage::sim;
  constexpr size_t kMostPoints = 64;
  TriangleMesh mesh;
  for (size_t at = 0; at + sizeof(Vec3) <= size && mesh.vertices.size() < kMostPoints; at += sizeof(Vec3)) {
    Vec3 point;
    std::memcpy(point.data(), data + at, sizeof point);
    if (point.allFinite()) mesh.vertices.push_back(point);
  }
  if (mesh.vertices.empty()) return 0;
  try {
    const ConvexPolyhedron hull = convex_hull(mesh.vertices);
    if (hull.vertices().empty()) __builtin_trap();
  } catch (const std::invalid_argument&) {
  }
  for (uint32_t i = 0; i + 2 < mesh.vertices.size(); ++i) mesh.triangles.push_back({i, i + 1, i + 2});
  try {
    const TriangleMesh welded = weld(mesh);
    if (!welded.triangles.empty()) decompose(welded, MeshTopology(welded));
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
