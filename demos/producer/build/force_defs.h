#pragma once
/// Conversion of a scene's forces to definitions of the simulation.

#include <string>
#include <vector>

#include "producer/scene/forces.h"
#include "sim/dynamics/force_field.h"

namespace offstage::producer {

/// Converts a force. The caller sets the objects on which it acts.
sim::ForceDef force_def(const Force& force);

/// Names of the objects on which a force acts.
struct ForceTargets {
  std::vector<std::string> bodies, particles, cloths;
};
ForceTargets targets_of(const Force& force);

}  // namespace offstage::producer
