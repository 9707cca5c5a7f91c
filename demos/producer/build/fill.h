#pragma once
/// Places that fill a volume at a packing; see Fill in the scene.

#include <cstddef>
#include <vector>

#include "producer/scene/values.h"

namespace offstage::producer {

/// Returns the centres relative to that of the volume, from below, without fill.position. `spacing` [m], > 0.
/// At most `most` places are returned, and one more to show that there would be more. The order and the
/// places depend only on the arguments.
std::vector<Vec3> fill_places(const Fill& fill, Real spacing, std::size_t most);

}  // namespace offstage::producer
