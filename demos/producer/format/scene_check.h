#pragma once
/// What a scene must be beyond the types and ranges of its keys: names that lead somewhere, times that
/// increase, files that exist, springs that the step can follow, emitters that can emit.

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

/// Checks a scene as described; `flat` is the same with placements expanded. `folder` is where files are
/// sought. Problems have a path only: who knows the text adds the lines.
Findings check_scene(const Scene& scene, const Scene& flat, const SceneFolder& folder);

/// The longest step at which the integrator can follow a damped spring of stiffness k and damping c on a
/// reduced mass m.
Real largest_stable_step(sim::IntegratorKind integrator, Real k, Real c, Real m);

/// What is wrong with a drag [kg/s] on what resists by m: a mass, or a moment of inertia.
std::optional<std::string> too_much_drag(const Scene& scene, sim::IntegratorKind integrator, Real drag,
                                         Real m);
/// What is wrong with a place that is not in the world.
std::optional<std::string> outside(const Scene& scene, const Vec3& position);

}  // namespace offstage::producer
