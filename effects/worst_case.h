#pragma once
/// How many particles a definition can lead to at most, for `validate` to refuse before a run (physics F3).
/// Bounds hold for every seed and are reached by definitions of constants; sums saturate.

#include <cstdint>

#include "effects/emitter_def.h"
#include "effects/split.h"
#include "effects/sub_emitter.h"
#include "effects/trail.h"

namespace offstage::effects {

/// Particles that something brings forth within a run. In any time t there are at most at_once + rate t born.
struct WorstCase {
  uint64_t born = 0;   ///< in all
  uint64_t alive = 0;  ///< at the end of any step
  Real lifespan = 0;   ///< the longest [s]
  Real at_once = 0;
  Real rate = 0;  ///< [1/s]
};

/// Of an emitter, from its start to `duration` [s] on its clock.
WorstCase worst_case(const EmitterDef& def, Real duration);
/// The children alone, of parents that come as `parents` says. `same_system`: they are born among them.
WorstCase worst_case(const SplitDef& def, const WorstCase& parents, bool same_system);
WorstCase worst_case(const TrailDef& def, const WorstCase& parents);
/// Each parent has one death and one age; of `hits_per_parent` in its life the caller must have an idea.
WorstCase worst_case(const SubEmitterDef& def, const WorstCase& parents, Real hits_per_parent = 1);

/// The highest rate [1/s] at which particles released one by one leave a cell before it is used again, so
/// that they do not overlap either; 0 on a mesh, whose places are drawn.
Real highest_clear_rate(const EmitterDef& def);

}  // namespace offstage::effects
