#pragma once
/// Forces of a scene as definitions of the simulation.

#include <string>
#include <vector>

#include "producer/scene/forces.h"
#include "sim/dynamics/force_field.h"

namespace offstage::producer {

/// Without what it acts on.
sim::ForceDef force_def(const Force& force);

/// Names of what a force acts on.
struct ForceTargets {
  std::vector<std::string> bodies, particles, cloths;
};
ForceTargets targets_of(const Force& force);

}  // namespace offstage::producer
