#pragma once
/// Checks of joints that need the whole scene: their bodies must exist, and their limits must suit the type
/// of joint.

#include "producer/format/scene_check.h"

namespace offstage::producer {

/// Adds the problems of a scene's joints to `findings`. `flat` is the same scene with placements expanded to
/// copies.
void check_joints(const Scene& scene, const Scene& flat, Findings& findings);

}  // namespace offstage::producer
