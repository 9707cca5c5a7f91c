#pragma once
/// Positions that fill a volume; see Fill in scene/values.h.

#include <cstddef>
#include <vector>

#include "producer/scene/values.h"

namespace offstage::producer {

/// Returns the positions [m] in ascending order of height, relative to the centre of the volume (without
/// fill.position). `spacing` is in m and greater than 0. A result of `most` + 1 positions means that the
/// volume has room for more than `most`. The result depends only on the arguments.
std::vector<Vec3> fill_places(const Fill& fill, Real spacing, std::size_t most);

}  // namespace offstage::producer
