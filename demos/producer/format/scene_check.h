#pragma once
/// Checks of a scene beyond the types and ranges of its keys. For example: names and files must exist, the
/// times of keys must increase, springs must be stable at the sub-step, and emitters must have valid
/// parameters.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "producer/base/error.h"
#include "producer/base/scene_folder.h"
#include "producer/scene/scene.h"

namespace offstage::producer {

struct Findings {
  std::vector<Problem> errors, warnings;
};

/// Checks a scene. `flat` is the same scene with placements expanded to copies. File names are relative to
/// `folder`. The problems contain only the path of a value; the caller adds file and line.
Findings check_scene(const Scene& scene, const Scene& flat, const SceneFolder& folder);

/// Returns the longest step [s] at which the integrator is stable for a spring without damping; damping is
/// stable with any step. `k`: stiffness [N/m]; `m`: reduced mass [kg].
Real largest_stable_step(sim::IntegratorKind integrator, Real k, Real m);

/// Returns an error message if a position is outside of `world.bounds`; otherwise nothing.
std::optional<std::string> outside(const Scene& scene, const Vec3& position);

}  // namespace offstage::producer
