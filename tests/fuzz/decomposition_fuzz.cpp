// Finite coordinates of any size as a mesh that is decomposed into convex parts.

#include <cstring>
#include <stdexcept>

#include "sim/geometry/convex_decomposition.h"
#include "sim/geometry/mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace offstage::sim;
  constexpr size_t kMostPoints = 12;  // so that one run takes a moment
  TriangleMesh mesh;
  for (size_t at = 0; at + sizeof(Vec3) <= size && mesh.vertices.size() < kMostPoints; at += sizeof(Vec3)) {
    Vec3 point;
    std::memcpy(point.data(), data + at, sizeof point);
    if (point.allFinite()) mesh.vertices.push_back(point);
  }
  for (uint32_t i = 0; i + 2 < mesh.vertices.size(); ++i) mesh.triangles.push_back({i, i + 1, i + 2});
  try {
    const TriangleMesh welded = weld(mesh);
    // An open sheet of three triangles can be divided into a thousand parts, which takes a minute with the
    // sanitizers.
    const DecompositionSettings few{.max_parts = 16, .most_parts = 16, .resolution = 32};
    if (!welded.triangles.empty()) decompose(welded, MeshTopology(welded), few);
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
