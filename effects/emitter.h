#pragma once
/// Planar emitters (physics F1, F2): release particles from a rectangle on a grid of cells, one particle per
/// cell, with every parameter a distribution and every birth at its own time inside the step.
///
/// The schedule depends on the emitter's own clock alone, so counts and spread are the same at any frame
/// rate.

#include <string>
#include <vector>

#include "effects/distribution.h"
#include "effects/random.h"
#include "sim/world.h"

namespace offstage::effects {

/// `count` particles at once at `time`, `cycles` times, `interval` apart.
struct Burst {
  Real time = 0;         ///< [s]
  Varying count = 10.0;  ///< rounded, >= 0
  int cycles = 1;        ///< >= 1
  Real interval = 1;     ///< [s], > 0
};

/// The rectangle particles leave from, in the frame of the body it is attached to, or the world. Its normal
/// is +Y of `pose`; particles leave along it.
struct PlanarSurface {
  sim::Pose pose;
  Eigen::Vector2d size = {0.1, 0.1};  ///< along X and Z of `pose` [m], > 0
};

struct EmitterDef {
  std::string name;  ///< also names its random stream
  uint64_t seed = 1;
  PlanarSurface surface;
  sim::BodyHandle body;    ///< null: fixed in the world; else moves with the body and adds its velocity
  Varying rate = 100.0;    ///< particles per second, released one by one; 0: only `count` and bursts
  Varying count = 0.0;     ///< particles per release, rounded; 0: no periodic release
  Varying interval = 0.1;  ///< between releases [s], > 0
  std::vector<Burst> bursts;
  Real start = 0;                  ///< [s]
  Real end = 1e30;                 ///< [s]
  Varying speed = 1.0;             ///< along the direction [m/s]
  Varying spread_deg = 0.0;        ///< angle from the surface normal [degrees]; azimuth uniform
  Varying radius = 0.01;           ///< [m], > 0
  Varying density = 1000.0;        ///< [kg/m^3]; gives the mass unless `mass` is set
  Varying mass = 0.0;              ///< [kg]; 0: from density and radius
  Varying lifespan = 5.0;          ///< [s], > 0
  Varying restitution = 0.3;       ///< in [0, 1]
  Varying friction = 0.5;          ///< >= 0
  uint64_t max_alive = 1'000'000;  ///< particles over this are not released, and counted
};

/// What an emitter has done so far.
struct EmitterReport {
  uint64_t released = 0;
  uint64_t skipped = 0;  ///< not released because max_alive was reached
  uint64_t waiting = 0;  ///< due, but the surface had no free cell; released later
  uint64_t waited = 0;   ///< how many had to wait in all
};

class Emitter {
 public:
  /// Throws std::invalid_argument if a parameter cannot be drawn from (radius <= 0, empty surface ...).
  Emitter(const EmitterDef& def, sim::ParticleSystemHandle target);

  /// Adds to the world the particles born in (start, end], each with the time it has left in this sub-step.
  void emit(sim::World& world, Real start, Real end);

  sim::ParticleSystemHandle target() const { return target_; }
  const EmitterReport& report() const { return report_; }
  const EmitterDef& def() const { return def_; }

 private:
  struct Release {
    Real time;
    uint64_t count;
    bool waited = false;  // for cells to become free
  };
  /// What leaves together: how many, and the grid of cells that they leave from.
  struct Grid {
    Real edge;  // of a cell; at least the largest diameter
    uint64_t nx, nz;
  };

  void collect_due(Real end);
  void collect_singles(Real end);
  void collect_periodic(Real end);
  void collect_bursts(Real end);
  Real next_birth(Real last);
  void release(sim::World& world, const Release& r, Real start, Real end);
  void wait(const Release& rest, Real end);
  void place(sim::World& world, uint64_t number, const Grid& grid, Real birth, Real end);
  Grid grid_of(const Release& r) const;
  Vec3 cell_centre(const Grid& grid, uint64_t cell) const;
  Real draw(const Varying& v, uint64_t number, uint32_t property, Real time) const;

  EmitterDef def_;
  sim::ParticleSystemHandle target_;
  RandomStream random_;
  EmitterReport report_;
  Real next_single_, next_periodic_;  // times of the next particle of `rate`, the next release of `count`
  uint64_t singles_ = 0, periodic_ = 0, rate_window_ = 0;
  std::vector<uint64_t> burst_cycles_;  // already released, per burst
  uint64_t number_ = 0;                 // of the next particle: what its draws depend on
  uint64_t cell_cursor_ = 0;            // position in the shuffled sequence of cells
  std::vector<Release> due_, waiting_;
};

}  // namespace offstage::effects
