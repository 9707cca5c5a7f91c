#pragma once
/// What only the whole of a scene shows of its joints: bodies that exist, limits that fit the kind of joint.

#include "producer/format/scene_check.h"

namespace offstage::producer {

void check_joints(const Scene& scene, const Scene& flat, Findings& findings);

}  // namespace offstage::producer
