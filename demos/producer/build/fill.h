#pragma once
/// Places that fill a volume at a packing; see Fill in the scene.

#include <cstddef>
#include <vector>

#include "producer/scene/values.h"

namespace offstage::producer {

/// Returns the centres of the places, ordered from below, relative to the centre of the volume; fill.position
/// is not added. `spacing` [m], > 0. At most `most` places are returned, and one more to show that there
/// would be more. The order and the places depend only on the arguments.
std::vector<Vec3> fill_places(const Fill& fill, Real spacing, std::size_t most);

}  // namespace offstage::producer
