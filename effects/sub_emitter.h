#pragma once
/// Sub-emitters: particles born where something happens to others: at an age, at a death, at
/// a hit. Splashes, bursting shells, sparks.

#include <string>
#include <vector>

#include "effects/distribution.h"
#include "effects/offspring.h"
#include "effects/parent.h"

namespace offstage::effects {

class Draws;

enum class Trigger {
  age,        ///< reached by the parent
  death,      ///< of the parent; its system must report deaths
  collision,  ///< of the parent; its system must report collisions
};

/// What newborns fly about.
enum class Axis {
  normal,    ///< of what was hit; without a hit as `velocity`
  velocity,  ///< the parent's after the event; at rest upwards
};

struct SubEmitterDef {
  std::string name;  ///< also names its random stream
  uint64_t seed = 1;
  Trigger trigger = Trigger::collision;
  Real age = 1;          ///< of the trigger `age` [s], >= 0
  Real probability = 1;  ///< that an event is answered, in [0, 1]
  Real min_speed = 0;    ///< of the parent after the event; slower ones are not answered [m/s]
  Varying count = 5.0;   ///< for each event, rounded
  Axis axis = Axis::normal;
  Varying velocity_percent = 0.0;  ///< of the parent's velocity after the event
  Varying speed = 1.0;             ///< added, about the axis [m/s]
  Varying spread_deg = 30.0;       ///< angle from the axis [degrees]; Uniform{0, 180} is all around
  Varying radius = 0.005;          ///< [m], > 0
  Varying density = 1000.0;        ///< [kg/m^3]; gives the mass unless `mass` is set
  Varying mass = 0.0;              ///< [kg]; 0: from density and radius
  Varying lifespan = 1.0;          ///< [s], > 0
  Varying restitution = 0.3;       ///< in [0, 1]
  Varying friction = 0.5;          ///< >= 0
  Varying charge = 0.0;            ///< [C]
  uint64_t max_per_step = 10'000;  ///< newborns in one sub-step; more are not released, and counted
  uint64_t max_alive = 1'000'000;  ///< particles over this are not released, and counted
};

/// Answers the events of one system with particles of another, or the same. Draws depend on the parent's id
/// and the time of the event.
class SubEmitter {
 public:
  /// Throws std::invalid_argument if a parameter cannot be drawn from.
  SubEmitter(const SubEmitterDef& def, sim::ParticleSystemHandle parents, sim::ParticleSystemHandle target);

  /// Adds to the world what answers the events of the last sub-step, and the ages reached in (start, end]. To
  /// be called before each sub-step.
  void emit(sim::World& world, Real start, Real end);

  const OffspringReport& report() const { return report_; }
  const SubEmitterDef& def() const { return def_; }

 private:
  void answer_events(sim::World& world, Real start, Real end);
  void answer_ages(sim::World& world, Real start, Real end);
  void answer(sim::World& world, const sim::ParticleEvent& event, Real start, Real end);
  sim::Particle answer_to(const sim::ParticleEvent& event, const Draws& draw) const;

  SubEmitterDef def_;
  sim::ParticleSystemHandle parents_, target_;
  RandomStream random_;
  Newcomers newcomers_;
  OffspringReport report_;
  uint64_t born_ = 0;  // in this sub-step
};

}  // namespace offstage::effects
