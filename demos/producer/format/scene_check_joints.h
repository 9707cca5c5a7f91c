#pragma once
/// Checks of joints that need the whole scene: bodies that exist, limits that fit the kind of joint.

#include "producer/format/scene_check.h"

namespace offstage::producer {

void check_joints(const Scene& scene, const Scene& flat, Findings& findings);

}  // namespace offstage::producer
