#pragma once
/// Emitters of a scene, and their child particles, as definitions of the effects library.

#include <cstdint>
#include <functional>
#include <string>

#include "effects/emitter_def.h"
#include "effects/split.h"
#include "effects/sub_emitter.h"
#include "effects/trail.h"
#include "effects/worst_case.h"
#include "producer/scene/particles.h"
#include "sim/particles/particles.h"

namespace offstage::producer {

/// The particle system of a source or a group. It reports what the source's offspring answers to.
sim::ParticleSystemDef system_def(const std::string& name, const ParticleBehaviour& behaviour);
sim::ParticleSystemDef system_def(const std::string& name, const ParticleSource& source);

/// Without its body and, if it is a model, without the triangles of its surface.
effects::EmitterDef emitter_def(const Emitter& emitter, uint64_t seed);
effects::SplitDef split_def(const ParticleSource& source, const std::string& name, uint64_t seed);
/// Of a child whose birth has a `trail`, or an `event`.
effects::TrailDef trail_def(const TrailSource& trail, const std::string& name, uint64_t seed);
effects::SubEmitterDef event_def(const Birth& birth, const std::string& name, uint64_t seed);

/// How many particles of a source there can be at most.
struct SourceBound {
  effects::WorstCase possible;  ///< whatever max_alive says
  uint64_t alive = 0;           ///< with max_alive
};
/// Calls visit(source, name, bound) for an emitter and all that is born from it in a film that ends at
/// `film_end` [s]. Distributions without ends count up to four deviations.
void bound_sources(
    const Emitter& emitter, Real film_end,
    const std::function<void(const ParticleSource&, const std::string&, const SourceBound&)>& visit);

}  // namespace offstage::producer
