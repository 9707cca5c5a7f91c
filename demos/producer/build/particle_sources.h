#pragma once
/// The emitters of a simulation, with all their child particles: builds their systems, releases particles,
/// and returns the points to draw.

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "effects/emitter.h"
#include "effects/split.h"
#include "effects/sub_emitter.h"
#include "effects/trail.h"
#include "producer/build/models.h"
#include "producer/build/snapshot.h"
#include "producer/scene/scene.h"
#include "sim/world.h"

namespace offstage::producer {

/// Computes the colour, size and rotation of particles from their look and age.
class LookRamps {
 public:
  LookRamps(const ParticleLook& look, uint64_t seed, const std::string& name);

  /// Returns the particles as drawn at `time` [s]. `places`: initial states of a group's particles, which may
  /// have individual colours; null for a source.
  PointSet points(const sim::ParticleArrays& particles, Real time,
                  const std::vector<ParticlePlace>* places) const;

 private:
  effects::StartColor start_;
  effects::RandomStream random_;
  std::optional<effects::Ramp<effects::Rgba>> color_, glow_;
  std::optional<effects::Ramp<float>> size_;
  bool oriented_, turns_;
  Varying angle_deg_, spin_deg_per_s_;
  effects::RandomStream turn_random_;
};

class ParticleSources {
 public:
  /// Returns the body with this name; null for an empty name.
  using FindBody = std::function<sim::BodyHandle(const std::string&)>;

  /// Builds the particle systems of all emitters. Throws SceneError for an emitter with invalid parameters.
  ParticleSources(const Scene& scene, const ModelLibrary& models, sim::World& world, const FindBody& body);

  /// Returns how long before time 0 the first particles are created [s]; 0 if no emitter prewarms.
  Real prewarm() const;

  /// Adds the particles that are created in (start, end] to the world. Must be called before each sub-step.
  void emit(sim::World& world, Real start, Real end);

  struct Counts {
    uint64_t waiting = 0;  ///< particles that were postponed for lack of room
    uint64_t skipped = 0;  ///< particles that were not released because of a limit
  };
  Counts counts() const;

  /// Appends one point set for each source, in the order of for_each_source() over the emitters.
  void add_points(const sim::World& world, std::vector<PointSet>& sets) const;
  /// Calls visit(full name, system, look) in the same order.
  template <class Visit>
  void for_each_system(Visit&& visit) const {
    for (const System& system : systems_) visit(system.name, system.handle, system.look);
  }
  /// Returns the system of a source, by its full name; null if there is none.
  sim::ParticleSystemHandle system(const std::string& name) const;

 private:
  struct System {
    std::string name;
    sim::ParticleSystemHandle handle;
    LookRamps look;
  };

  void add(const Emitter& emitter, const ModelLibrary& models, sim::World& world, const FindBody& body,
           uint64_t seed);

  std::vector<System> systems_;
  std::deque<effects::Emitter> emitters_;
  std::deque<effects::Splitter> splitters_;
  std::deque<effects::Trail> trails_;
  std::deque<effects::SubEmitter> sub_emitters_;
};

}  // namespace offstage::producer
