#pragma once
/// Copies of bodies, cloths and emitters in rows, rings, grids and at random places.
///
/// The three kinds multiply: a repeat of a grid of a scatter. The same scene gives the same copies, bit for
/// bit.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "producer/base/error.h"
#include "producer/scene/scene.h"

namespace offstage::producer {

/// Of a scene with all copies. A body takes up to 10 kB, so that they fit into 2 GB.
inline constexpr std::size_t kMostBodies = 200'000;
inline constexpr int kMaxCopies = 100'000;  ///< of one object

/// A rigid motion of the world that carries an original, with all its keyframes, to one of its copies.
struct PlacedCopy {
  sim::Pose motion;    ///< copy from original, both in world coordinates
  Real scale = 1;      ///< of the object's own size
  std::string suffix;  ///< of its name: "_0", "_1" ...
};

struct Copies {
  std::vector<PlacedCopy> placed;
  int left_out = 0;  ///< scattered copies that found no place min_distance away from the others
};

/// How many copies a placement asks for; kMaxCopies + 1 if more than kMaxCopies.
int copy_count(const Placement& placement);

/// The copies of an object at `position`; one without suffix if there is no placement. The random numbers of
/// a scatter are those of the seed, the object's name and the scatter's own seed. At most kMaxCopies may be
/// asked for.
Copies expand(const Placement& placement, const Vec3& position, uint64_t seed, std::string_view name);

/// Replaces each body, cloth and emitter that has a placement by its copies, also in the lists of what forces
/// act on. Adds to `errors` those with too many copies, which stay as they are, and to `warnings` those of
/// which some found no place.
Scene expand(const Scene& scene, std::vector<Problem>& errors, std::vector<Problem>& warnings);

}  // namespace offstage::producer
