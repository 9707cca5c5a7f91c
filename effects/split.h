#pragma once
/// Splitting particles (physics F3): from a given age on, a particle releases children, whose velocity, size
/// and lifespan are percentages of its own.

#include <functional>
#include <queue>
#include <string>
#include <vector>

#include "effects/distribution.h"
#include "effects/offspring.h"
#include "effects/parent.h"

namespace offstage::effects {

class Draws;

/// Percentages are of the parent's value at the time of the split; 100 gives the same value.
struct SplitDef {
  std::string name;  ///< name of the split, which also selects its random numbers
  uint64_t seed = 1;
  bool enabled = true;
  Varying count = 2.0;  ///< children per split, rounded
  Varying age = 1.0;    ///< age of the parent at its first split [s], > 0
  /// Time from one split of a parent to its next [s], > 0; for n simulation steps use n WorldDef::max_step.
  Varying delay = 0.5;
  /// Greatest number of splits in a line of descent, including the splits of ancestors. If children can
  /// split, too, one particle becomes at most (1 + count)^depth.
  int depth = 1;
  Varying velocity_percent = 100.0;
  Varying spread_deg = 0.0;       ///< angle from the parent's direction [degrees]
  Varying radius_percent = 50.0;  ///< > 0
  /// Mass of a child; 0: the mass for which the child has the parent's density.
  Varying mass_percent = 0.0;
  Varying lifespan_percent = 100.0;  ///< > 0
  uint64_t max_alive = 1'000'000;  ///< greatest number of living particles in the children's system; further
                                   ///< children are not released, but counted
};

/// Splits the particles of one system into children of the same system, which then split themselves, or into
/// children of another system. The parent continues to exist. Random numbers depend only on the line of
/// descent, so they do not depend on the order of events.
class Splitter {
 public:
  /// Throws std::invalid_argument if a parameter is out of range.
  Splitter(const SplitDef& def, sim::ParticleSystemHandle parents, sim::ParticleSystemHandle children);

  /// Adds the children created in (start, end]. Call it before each sub-step.
  void emit(sim::World& world, Real start, Real end);

  const OffspringReport& report() const { return report_; }
  const SplitDef& def() const { return def_; }

 private:
  /// The next split of a particle.
  struct Due {
    Real time;
    uint64_t id, line;  // line: number of its line of descent
    int left;           // remaining splits, this one included
    int done;           // number of splits it has made

    friend bool operator>(const Due& a, const Due& b) {
      return a.time != b.time ? a.time > b.time : a.id > b.id;
    }
  };

  void enter_new_particles(const sim::World& world, Real now);
  void enter(uint64_t id, uint64_t line, Real birth_time, int left);
  void split(sim::World& world, const Due& due, Real start, Real end);
  sim::Particle child_of(const Parent& parent, const Draws& draw) const;

  SplitDef def_;
  sim::ParticleSystemHandle parents_, children_;
  RandomStream random_;
  NewParents new_parents_;
  std::priority_queue<Due, std::vector<Due>, std::greater<>> due_;
  std::vector<uint64_t> own_children_;  // ids of children in the system of their parents, ascending
  OffspringReport report_;
};

}  // namespace offstage::effects
