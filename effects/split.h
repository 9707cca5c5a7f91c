#pragma once
/// Particles that split (physics F3): from some age on each throws off children that take part of its
/// velocity, size and lifespan.

#include <functional>
#include <queue>
#include <string>
#include <vector>

#include "effects/distribution.h"
#include "effects/offspring.h"
#include "effects/parent.h"

namespace offstage::effects {

class Draws;

/// Percentages are of the parent's at the time of the split; 100 passes it on.
struct SplitDef {
  std::string name;  ///< also names its random stream
  uint64_t seed = 1;
  bool enabled = true;
  Varying count = 2.0;  ///< children of one split, rounded
  Varying age = 1.0;    ///< of the parent at its first split [s], > 0
  Varying delay = 0.5;  ///< to its next split [s], > 0; n simulation steps are n WorldDef::max_step
  /// The most splits of a particle, those of its ancestors included: where children can split too, one
  /// particle becomes at most (1 + count)^depth.
  int depth = 1;
  Varying velocity_percent = 100.0;
  Varying spread_deg = 0.0;          ///< angle from the parent's direction [degrees]
  Varying radius_percent = 50.0;     ///< > 0
  Varying mass_percent = 0.0;        ///< of each child; 0: of the parent's density
  Varying lifespan_percent = 100.0;  ///< > 0
  uint64_t max_alive = 1'000'000;    ///< children over this are not released, and counted
};

/// Splits the particles of one system into children of the same one, which then split in their turn, or of
/// another. The parent lives on. Draws depend on the line of descent alone, so no order of events changes
/// them.
class Splitter {
 public:
  /// Throws std::invalid_argument if a parameter cannot be drawn from.
  Splitter(const SplitDef& def, sim::ParticleSystemHandle parents, sim::ParticleSystemHandle children);

  /// Adds the children born in (start, end]. To be called before each sub-step.
  void emit(sim::World& world, Real start, Real end);

  const OffspringReport& report() const { return report_; }
  const SplitDef& def() const { return def_; }

 private:
  /// The next split of a particle.
  struct Due {
    Real time;
    uint64_t id, line;  // the number of its descent
    int left;           // splits, this one included
    int done;           // its own

    friend bool operator>(const Due& a, const Due& b) {
      return a.time != b.time ? a.time > b.time : a.id > b.id;
    }
  };

  void enter_newcomers(const sim::World& world, Real now);
  void enter(uint64_t id, uint64_t line, Real birth, int left);
  void split(sim::World& world, const Due& due, Real start, Real end);
  sim::Particle child_of(const Parent& parent, const Draws& draw) const;

  SplitDef def_;
  sim::ParticleSystemHandle parents_, children_;
  RandomStream random_;
  Newcomers newcomers_;
  std::priority_queue<Due, std::vector<Due>, std::greater<>> due_;
  std::vector<uint64_t> own_children_;  // ids of those in the system of their parents, ascending
  OffspringReport report_;
};

}  // namespace offstage::effects
