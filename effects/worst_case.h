#pragma once
/// Bounds of the number of particles that a definition can create. With them `validate` can refuse a
/// definition before a run (physics F3). The bounds hold for every seed. Scenes with constant parameters
/// reach them. Sums that would overflow are clamped to the largest number.

#include <cstdint>

#include "effects/emitter_def.h"
#include "effects/split.h"
#include "effects/sub_emitter.h"
#include "effects/trail.h"

namespace offstage::effects {

/// Bounds for the particles created in a run. In any interval of length t, at most at_once + rate * t
/// particles are created.
struct WorstCase {
  uint64_t born = 0;   ///< total number
  uint64_t alive = 0;  ///< number at the end of any step
  Real lifespan = 0;   ///< longest lifespan [s]
  Real at_once = 0;
  Real rate = 0;  ///< [1/s]
};

/// Returns bounds for an emitter, from its start to `duration` [s] on its clock.
WorstCase worst_case(const EmitterDef& def, Real duration);
/// Returns bounds for the children alone. `parents`: bounds for their parents. `same_system`: whether
/// children are in the system of their parents.
WorstCase worst_case(const SplitDef& def, const WorstCase& parents, bool same_system);
WorstCase worst_case(const TrailDef& def, const WorstCase& parents);
/// Returns bounds for a sub-emitter. Each parent has one death and reaches the age once. `hits_per_parent`:
/// number of collisions in a parent's life, as estimated by the caller.
WorstCase worst_case(const SubEmitterDef& def, const WorstCase& parents, Real hits_per_parent = 1);

/// Returns the highest rate [1/s] at which particles that are released one by one do not overlap, because
/// each leaves its cell before the cell is used again. Returns 0 on a mesh, which has no cells.
Real highest_clear_rate(const EmitterDef& def);

}  // namespace offstage::effects
