#pragma once
/// Private: the particles of a stage as rays of mirror images meet them.

#include <span>
#include <vector>

#include "render/frame.h"
#include "render/points_pass.h"
#include "render/puffs_pass.h"
#include "render/trace/ray_particles.h"

namespace offstage::render {

/// Returns the particles of the sets, except balls, which are objects of the RayScene. `pixel_m`: width of a
/// pixel at a distance of 1 m [m]. Thin particles become about as wide as the cells in which mirror images
/// are traced, and fainter. `puffs` must be prepared with these sets.
std::vector<RayParticleSet> particles_for_rays(std::span<const PointSet* const> sets, const PuffsPass& puffs,
                                               const View& view, float pixel_m);

}  // namespace offstage::render
