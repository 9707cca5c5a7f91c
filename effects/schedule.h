#pragma once
/// The schedule of an emitter: times of its releases, and numbers of particles. It depends only on the
/// emitter's own clock, so it is the same at any frame rate.

#include <algorithm>
#include <vector>

#include "effects/emitter_def.h"

namespace offstage::effects {

/// Particles that are due at one time.
struct Release {
  Real time;
  uint64_t count;
  bool together = false;  ///< whether the particles are released together, as by `count` and bursts
  bool waited = false;    ///< whether the release was postponed for lack of room on the surface
};

class Schedule {
 public:
  /// `origin`: the time at which the emitter's clock shows 0.
  Schedule(const EmitterDef& def, Real origin);

  /// Appends the releases that are due until `end` and were not returned before. Each kind of release is in
  /// the order of time.
  void collect(Real end, std::vector<Release>& due);
  /// Nothing is released after this time.
  void stop(Real time) { end_ = std::min(end_, time); }

 private:
  void collect_singles(Real end, std::vector<Release>& due);
  void collect_periodic(Real end, std::vector<Release>& due);
  void collect_bursts(Real end, std::vector<Release>& due);
  Real next_birth_time(Real last);
  Real draw(const Varying& v, uint64_t number, uint32_t property, Real time) const;
  bool open(Real time) const;

  // Times in this class are on the world's clock. Times in the definitions are on the emitter's clock.
  Varying rate_, count_, interval_;
  std::vector<Burst> bursts_;
  std::vector<TimeWindow> windows_;
  RandomStream random_;
  Real origin_, start_, end_;
  Real next_single_, next_periodic_;  // times of the next particle of `rate`, the next release of `count`
  uint64_t singles_ = 0, periodic_ = 0, rate_window_ = 0;
  std::vector<uint64_t> burst_cycles_;  // number of cycles already released, for each burst
};

}  // namespace offstage::effects
