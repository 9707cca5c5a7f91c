#pragma once
/// Values and parts that objects of several kinds have in a scene: colours, and copies.

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "effects/distribution.h"
#include "producer/base/error.h"
#include "sim/core/types.h"

namespace offstage::producer {

using effects::Varying;
using sim::Quat;
using sim::Real;
using sim::Vec3;

/// Linear colour with straight alpha. In files "#rrggbb", "#rrggbbaa", "#rgb", "#rgba" (sRGB) or linear [r,
/// g, b] or [r, g, b, a].
struct Color {
  Eigen::Vector4f rgba = {1, 1, 1, 1};
  Eigen::Vector3f rgb() const { return rgba.head<3>(); }
};

/// A model file as a shape: its triangles collide and give the mass; of a cloth, they are the cloth.
struct MeshFile {
  std::string file;
  Real scale = 1;
};

/// Copies in a row or a ring: copy i is moved by i * offset and turned by i * turn_deg about the vertical
/// through `pivot`.
struct Repeat {
  int count = 2;
  Vec3 offset = Vec3::Zero();
  Real turn_deg = 0;
  Vec3 pivot = Vec3::Zero();
};
/// Copies on a grid centred on the original in x and z, upwards from it in y.
struct Grid {
  Eigen::Vector3i count = {1, 1, 1};
  Vec3 spacing = Vec3::Ones();
};
/// Copies at random places of a rectangle centred on the original.
struct Scatter {
  int count = 10;
  Eigen::Vector2d size = {10, 10};  ///< along x and z
  Real min_distance = 0;            ///< between copies; those that find no place are left out with a warning
  bool turn = true;                 ///< random turn about the vertical
  Varying scale = 1.0;              ///< of a body's shape and model
  uint64_t seed = 1;
};
struct Placement {
  std::optional<Repeat> repeat;
  std::optional<Grid> grid;
  std::optional<Scatter> scatter;
};

}  // namespace offstage::producer
