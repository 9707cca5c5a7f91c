#pragma once
/// Report of an object whose state is no longer finite.

#include <cstdint>
#include <string>

#include "sim/core/types.h"

namespace offstage::sim {

/// An object whose state became infinite or NaN, with its last finite state and the state after it [m],
/// [m/s]. For a body, `position_before` is the position of its origin, and `velocity_before` is not set. The
/// other values belong to the centre of mass.
struct NonFinite {
  std::string object;     ///< name of the body, the particle system or the cloth
  uint64_t particle = 0;  ///< id of the particle in its system, or index of the vertex of a cloth
  Vec3 position_before = Vec3::Zero(), velocity_before = Vec3::Zero();
  Vec3 position = Vec3::Zero(), velocity = Vec3::Zero();
};

}  // namespace offstage::sim
