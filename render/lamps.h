#pragma once
/// Private: lamps that represent the light of fires.

#include "render/points_pass.h"

namespace offstage::render {

/// Returns a lamp in the middle of a fire that gives as much light as its flames.
Lamp lamp_of_fire(const PointSet& flames);

}  // namespace offstage::render
