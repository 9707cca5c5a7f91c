#pragma once
/// Checks of particle groups, emitters and child particles, for scene_check.h.

#include <cstdint>
#include <string>
#include <vector>

#include "producer/format/scene_check.h"

namespace offstage::producer {

/// Adds the problems of the particles of a scene to `findings`; `flat` is the same scene with placements
/// expanded to copies.
void check_particles(const Scene& scene, const Scene& flat, Findings& findings);

/// Returns the names of all particle systems: groups, emitters and child particles.
std::vector<std::string> particle_names(const Scene& scene);

/// Upper bound of the number of particles that a system has at the same time.
struct ParticleBound {
  std::string name;
  uint64_t alive = 0;
};
/// Returns the upper bound of the number of particles for each particle system. `scene` must have its copies
/// expanded.
std::vector<ParticleBound> particle_bounds(const Scene& scene);

}  // namespace offstage::producer
