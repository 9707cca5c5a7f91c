#pragma once
/// Conversion of ready-made articulations to bodies and joints, and of a scene's joints to sim::JointDef.

#include <vector>

#include "producer/scene/scene.h"

namespace offstage::producer {

/// Adds the bodies and joints of all articulations in `scene` to `flat`. Also copies each joint once for each
/// copy of its bodies. Problems with the number of copies are added to `errors` and `warnings`.
void expand_joints(const Scene& scene, Scene& flat, std::vector<Problem>& errors,
                   std::vector<Problem>& warnings);

/// Returns whether joints of this type have a length, which `length_limits` can limit.
bool has_rope(sim::JointType type);
/// Returns the length of a joint for which has_rope() is true, at time 0 [m].
Real rope_length(const Joint& joint);

/// Converts a joint. The caller sets the bodies.
sim::JointDef joint_def(const Joint& joint);

}  // namespace offstage::producer
