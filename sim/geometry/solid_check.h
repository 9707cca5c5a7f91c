#pragma once
/// Check of the mesh of a dynamic body, whose mass follows from its inside.

#include <string>

#include "sim/geometry/mesh.h"

namespace offstage::sim {

/// Returns an error message if a mesh with these defects cannot be the shape of a dynamic body; empty if it
/// can.
inline std::string problem_of_solid(const MeshDefects& defects) {
  if (defects.closed() && !defects.inverted) return {};
  return "a dynamic body needs a closed mesh, this one has: " + defects.describe();
}

}  // namespace offstage::sim
