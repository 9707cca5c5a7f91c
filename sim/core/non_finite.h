#pragma once
/// The report of an object whose state stopped being finite.

#include <cstdint>
#include <string>

#include "sim/core/types.h"

namespace offstage::sim {

/// Something that stopped being finite: what it was just before, and what became of it. Bodies: centre of
/// mass; the velocity before is not kept.
struct NonFinite {
  std::string object;     ///< name of the body, the particle system or the cloth
  uint64_t particle = 0;  ///< its id, in a system; the point of a cloth
  Vec3 position_before = Vec3::Zero(), velocity_before = Vec3::Zero();
  Vec3 position = Vec3::Zero(), velocity = Vec3::Zero();
};

}  // namespace offstage::sim
