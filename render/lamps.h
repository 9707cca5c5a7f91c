#pragma once
/// Private: lamps that stand for the light of fires.

#include "render/points_pass.h"

namespace offstage::render {

/// Creates a lamp in the middle of a fire, as bright as its flames.
Lamp lamp_of_fire(const PointSet& flames);

}  // namespace offstage::render
