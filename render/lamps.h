#pragma once
/// Private: fires as lamps.

#include "render/points_pass.h"

namespace offstage::render {

/// Creates a lamp in the middle of a fire, as bright as its flames.
Lamp lamp_of_fire(const PointSet& flames);

}  // namespace offstage::render
