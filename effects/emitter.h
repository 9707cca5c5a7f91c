#pragma once
/// Emitters (physics F1, F2): release particles from a surface, with every parameter a distribution. Each
/// particle is created at its own time within the step, from the position of the surface at that time.
///
/// Particles of one release never overlap. On a plane, a sphere or a disc each particle gets a cell, in
/// shuffled order; on a mesh its distance to the others is checked. Particles that collide with particles do
/// not overlap living ones, either; those of `rate` are then placed anywhere on the surface, since particles
/// from the middles of few cells would build towers. Particles for which there is no room are released later.
/// The schedule depends only on the emitter's own clock, so that numbers and distribution are the same at any
/// frame rate.

#include "effects/emitter_def.h"
#include "effects/neighbours.h"
#include "effects/schedule.h"
#include "effects/spacing.h"

namespace offstage::effects {

class Draws;

/// Counts of an emitter since its start.
struct EmitterReport {
  uint64_t released = 0;
  uint64_t skipped = 0;  ///< particles that were not released because max_alive was reached
  uint64_t waiting = 0;  ///< particles that were due, but had no room on the surface; they are released later
  uint64_t waited = 0;   ///< total number of particles that were postponed
};

class Emitter {
 public:
  /// Throws std::invalid_argument if a parameter is out of range (radius <= 0, empty surface ...). `origin`
  /// is the world's time at which the emitter's clock shows 0. If the emitter prewarms, call World::prewarm()
  /// for that time, so that particles released before time 0 move and collide until time 0. Otherwise the
  /// first emit() moves them by free flight, through bodies.
  Emitter(const EmitterDef& def, sim::ParticleSystemHandle target, Real origin = 0);

  /// Adds the particles created in (start, end] to the world, each with its remaining time in this sub-step.
  void emit(sim::World& world, Real start, Real end);

  /// Stops the emitter: after this time of the world [s] it releases nothing, not even postponed particles.
  /// Existing particles remain.
  void stop(Real time);

  sim::ParticleSystemHandle target() const { return target_; }
  const EmitterReport& report() const { return report_; }
  const EmitterDef& def() const { return def_; }

 private:
  /// A release in progress.
  struct Batch {
    uint64_t count;
    bool together;
    Real birth_time, end;
    Real diameter;  // largest diameter of its particles
    sim::Motion carrier;
  };

  void collect_along_path(const sim::World& world, Real start, Real end);
  void collect_due(Real end);
  void find_neighbours(const sim::World& world, Real start, Real end);
  uint64_t place(sim::World& world, const Batch& batch);
  void release(sim::World& world, const Release& r, Real start, Real end);
  void wait(const Batch& batch, uint64_t rest, bool waited, Real start);
  void postpone(const Release& rest, Real end);
  Real largest_diameter(uint64_t count, Real birth_time) const;
  uint64_t place_anywhere(sim::World& world, const Batch& batch);
  uint64_t place_in_cells(sim::World& world, const Batch& batch);
  uint64_t place_apart(sim::World& world, const Batch& batch);
  void begin_cells(const Cells& cells, uint64_t count);
  bool is_free(const Place& place, const Draws& draw);
  void add(sim::World& world, const Draws& draw, const Place& place, const Batch& batch);

  EmitterDef def_;
  sim::ParticleSystemHandle target_;
  Real origin_, stopped_;
  RandomStream random_;
  ReleaseSurface surface_;
  Schedule schedule_;
  Spacing spacing_;
  Neighbours neighbours_;
  bool meets_particles_ = false;  // whether its particles collide with particles
  Real retry_;                    // no particle that collides with particles is released before this time [s]
  EmitterReport report_;
  uint64_t number_ = 0;        // number of the next particle, on which its random numbers depend
  Real path_fraction_ = 0;     // fraction of the next particle of rate_per_metre that is already due, below 1
  uint64_t cell_cursor_ = 0;   // position in the shuffled sequence of cells
  std::array<Real, 3> turn_;   // rotation of the cells for one round
  uint64_t turned_round_ = 0;  // number of the round for which turn_ is valid, from 1
  std::vector<Release> due_, waiting_;
};

}  // namespace offstage::effects
