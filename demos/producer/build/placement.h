#pragma once
/// Copies of bodies, cloths and emitters in rows, rings, grids, volumes and at random places.
///
/// The four kinds multiply: `repeat` copies the grid, `grid` the fill, `fill` the scattered copies. The same
/// scene gives exactly the same copies.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "producer/base/error.h"
#include "producer/scene/scene.h"

namespace offstage::producer {

/// Limit for a scene with all copies. A body takes up to 10 kB, so they fit into 2 GB.
inline constexpr std::size_t kMostBodies = 200'000;
inline constexpr int kMaxCopies = 100'000;  ///< limit for one object

/// One copy of an object. `motion` applies to the original and to all its keyframes.
struct PlacedCopy {
  sim::Pose motion;    ///< maps the original to the copy, in world coordinates
  Real scale = 1;      ///< factor of the object's size
  std::string suffix;  ///< suffix of the copy's name: "_0", "_1" ...
};

struct Copies {
  std::vector<PlacedCopy> placed;
  int left_out = 0;  ///< number of scattered copies without room at min_distance from the others
};

/// Returns whether a fill lacks the spacing that copies need.
bool needs_spacing(const Placement& placement);

/// Returns the number of copies of a placement; kMaxCopies + 1 if there are more than kMaxCopies.
int copy_count(const Placement& placement);

/// Returns the copies of an object at `position`; one without suffix if there is no placement. The random
/// numbers of a scatter depend on the seed, the object's name and the scatter's own seed. There may be at
/// most kMaxCopies.
Copies expand(const Placement& placement, const Vec3& position, uint64_t seed, std::string_view name);

/// Replaces each body, cloth and emitter with a placement by its copies, also in the lists of objects on
/// which forces act. Objects with too many copies stay unchanged and are added to `errors`; those with copies
/// that found no room are added to `warnings`.
Scene expand(const Scene& scene, std::vector<Problem>& errors, std::vector<Problem>& warnings);

}  // namespace offstage::producer
