#pragma once
/// The definition of an emitter: surface, parameters and times of its particles (physics F1, F2). Every
/// number can be a distribution.

#include <string>
#include <vector>

#include "effects/distribution.h"
#include "effects/emitter_surface.h"
#include "effects/new_particles.h"
#include "sim/world.h"

namespace offstage::effects {

/// `count` particles at once at `time`, repeated `cycles` times at intervals of `interval`.
struct Burst {
  Real time = 0;         ///< [s]
  Varying count = 10.0;  ///< rounded, >= 0
  int cycles = 1;        ///< >= 1
  Real interval = 1;     ///< [s], > 0
};

/// The times in [start, end) [s].
struct TimeWindow {
  Real start = 0, end = 1e30;
};

/// The directions and times at which an emitter releases particles. Times are on the emitter's clock, which
/// shows 0 at the `origin` given to the Emitter.
struct EmitterRelease {
  /// Direction of release, in the frame of the body or the world; zero: the normal of the surface.
  Vec3 direction = Vec3::Zero();
  Real inherit_velocity = 1;  ///< fraction of the velocity of the body's point that particles get, >= 0
  bool recoil =
      false;  ///< whether a dynamic body gets the opposite of the particles' momentum relative to it
  /// Whether particles may overlap when they are released. They are then placed anywhere on the surface and
  /// never postponed. Use it for particles that do not collide with each other. If false, particles that are
  /// released together do not overlap, and those that collide with particles do not overlap living ones.
  bool overlap = false;
  Varying rate = 100.0;  ///< particles per second, released one by one; 0: only `count` and bursts
  /// Particles per metre of the path of the emitter's origin [1/m], >= 0. They are distributed evenly along
  /// the path.
  Varying rate_per_metre = 0.0;
  Varying count = 0.0;     ///< particles per release, rounded; 0: no periodic release
  Varying interval = 0.1;  ///< time between releases [s], > 0
  std::vector<Burst> bursts = {};
  Real start = 0;                        ///< start of `rate` and `count` [s]
  Real end = 1e30;                       ///< end of all releases [s]; existing particles remain
  std::vector<TimeWindow> windows = {};  ///< times in which `rate` and `count` release; empty: always
  Real prewarm = 0;                      ///< time by which `rate` and `count` begin before `start` [s], >= 0
};

struct EmitterDef {
  std::string name = {};  ///< name of the emitter, which also selects its random numbers
  uint64_t seed = 1;
  EmitterSurface surface = {};
  /// The body with which the emitter moves; null: it is fixed in the world. While the body does not exist,
  /// nothing is released, and releases that are due are discarded.
  sim::BodyHandle body = {};
  EmitterRelease release = {};
  NewParticles particles = {};
};

}  // namespace offstage::effects
