#pragma once
/// Conversion of a scene's emitters, and their child particles, to definitions of the effects library.

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

/// Returns the particle system of a group or a source. The system of a source also reports the events that
/// start its sub-emitters.
sim::ParticleSystemDef system_def(const std::string& name, const sim::ParticleSystemDef& behaviour);
sim::ParticleSystemDef system_def(const std::string& name, const ParticleSource& source);

/// Returns the definition of an emitter. The caller sets its body and the triangles of a model surface.
effects::EmitterDef emitter_def(const Emitter& emitter, uint64_t seed);
effects::SplitDef split_def(const ParticleSource& source, const std::string& name, uint64_t seed);
/// Returns the definition for a child that a trail or an event of its parent emits.
effects::TrailDef trail_def(const TrailSource& trail, const std::string& name, uint64_t seed);
effects::SubEmitterDef event_def(const Emission& emission, const std::string& name, uint64_t seed);

/// Bounds on the number of particles of a source.
struct SourceBound {
  effects::WorstCase possible;  ///< bounds without the limit `max_alive`
  uint64_t alive = 0;           ///< number of particles at once, limited by max_alive
};
/// Calls visit(source, name, bound) for an emitter and all of its child particles in a film that ends at
/// `film_end` [s]. Distributions without bounds are bounded at four deviations.
void bound_sources(
    const Emitter& emitter, Real film_end,
    const std::function<void(const ParticleSource&, const std::string&, const SourceBound&)>& visit);

}  // namespace offstage::producer
