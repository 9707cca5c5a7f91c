#pragma once
/// Greatest number of particles that a definition can create, so that `validate` can refuse it before a run
/// (physics F3). The bounds hold for every seed. Scenes with constant parameters reach them. Sums that would
/// overflow are clamped to the largest number.

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

/// Bounds for an emitter, from its start to `duration` [s] on its clock.
WorstCase worst_case(const EmitterDef& def, Real duration);
/// Bounds for the number of children alone. `parents` are the bounds for their parents. `same_system`:
/// children are in the system of their parents.
WorstCase worst_case(const SplitDef& def, const WorstCase& parents, bool same_system);
WorstCase worst_case(const TrailDef& def, const WorstCase& parents);
/// Bounds for a sub-emitter. Each parent has one death and reaches the age once; the caller estimates
/// `hits_per_parent`, the number of collisions in its life.
WorstCase worst_case(const SubEmitterDef& def, const WorstCase& parents, Real hits_per_parent = 1);

/// The highest rate [1/s] at which particles that are released one by one do not overlap, because each leaves
/// its cell before the cell is used again. 0 on a mesh, which has no cells.
Real highest_clear_rate(const EmitterDef& def);

}  // namespace offstage::effects
