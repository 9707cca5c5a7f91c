#pragma once
/// Checks of joints that need the whole scene: bodies that exist, limits that fit the kind of joint.

#include "producer/format/scene_check.h"

namespace offstage::producer {

/// Adds the problems to `findings`; `flat` is the same scene with placements expanded to copies.
void check_joints(const Scene& scene, const Scene& flat, Findings& findings);

}  // namespace offstage::producer
