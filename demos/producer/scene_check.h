#pragma once
/// What a scene must be beyond the types and ranges of its keys: names that lead somewhere, times that
/// increase, files that exist, springs that the step can follow, emitters that can emit.

#include <filesystem>
#include <vector>

#include "producer/error.h"
#include "producer/scene.h"

namespace offstage::producer {

struct Findings {
  std::vector<Problem> errors, warnings;
};

/// Checks a scene as described; `flat` is the same with placements expanded. `folder` is where files are
/// sought. Problems have a path only: who knows the text adds the lines.
Findings check_scene(const Scene& scene, const Scene& flat, const std::filesystem::path& folder);

/// The longest step at which the integrator can follow a damped spring of stiffness k and damping c on a
/// reduced mass m.
Real largest_stable_step(sim::IntegratorKind integrator, Real k, Real c, Real m);

/// About how many particles an emitter has alive at its height until `film_end`, were it not for max_alive.
Real expected_alive(const Emitter& emitter, Real film_end);

}  // namespace offstage::producer
