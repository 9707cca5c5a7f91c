#pragma once
/// Trails: particles that living particles leave behind them, as the stars of a firework do.

#include <string>
#include <vector>

#include "effects/distribution.h"
#include "effects/offspring.h"
#include "effects/parent.h"

namespace offstage::effects {

class Draws;

struct TrailDef {
  std::string name;  ///< also names its random stream
  uint64_t seed = 1;
  Varying rate = 60.0;             ///< particles per second of each parent, drawn once for its life; no curve
  Real start_age = 0;              ///< of the parent [s], >= 0
  Real end_age = 1e30;             ///< of the parent [s]
  Varying velocity_percent = 0.0;  ///< of the parent's velocity
  Varying speed = 0.0;             ///< added, along a direction about the parent's, backwards [m/s]
  Varying spread_deg = 0.0;        ///< angle from that direction [degrees]
  Varying radius = 0.005;          ///< [m], > 0
  Varying density = 1000.0;        ///< [kg/m^3]; gives the mass unless `mass` is set
  Varying mass = 0.0;              ///< [kg]; 0: from density and radius
  Varying lifespan = 1.0;          ///< [s], > 0
  Varying restitution = 0.3;       ///< in [0, 1]
  Varying friction = 0.5;          ///< >= 0
  Varying charge = 0.0;            ///< [C]
  uint64_t max_alive = 1'000'000;  ///< particles over this are not released, and counted
};

/// Every parent leaves its trail at its own even times, from where it is at each, so a trail has no clumps
/// however fast it moves. Draws depend on the parent's id and the number of the particle in its trail.
class Trail {
 public:
  /// Throws std::invalid_argument if a parameter cannot be drawn from, or if both systems are the same.
  Trail(const TrailDef& def, sim::ParticleSystemHandle parents, sim::ParticleSystemHandle target);

  /// Adds what is left behind in (start, end]. To be called before each sub-step.
  void emit(sim::World& world, Real start, Real end);

  const OffspringReport& report() const { return report_; }
  const TrailDef& def() const { return def_; }

 private:
  void leave(sim::World& world, std::size_t i, bool is_new, Real start, Real end);
  sim::Particle left_by(const Parent& parent, const Draws& draw) const;

  TrailDef def_;
  sim::ParticleSystemHandle parents_, target_;
  RandomStream random_;
  Newcomers newcomers_;
  OffspringReport report_;
};

}  // namespace offstage::effects
