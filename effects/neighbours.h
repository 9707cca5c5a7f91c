#pragma once
/// Private: the living particles near an emitter with which its new particles would collide.

#include <vector>

#include "effects/spacing.h"
#include "sim/world.h"

namespace offstage::effects {

class Neighbours {
 public:
  /// Whether particles of a system collide with particles of any system.
  static bool exist(const sim::World& world, sim::ParticleSystemHandle system);

  /// Finds the particles that may come into a ball in the sub-step from `start` to `end` [s]. They are those
  /// of `system` if it is internal, and those of the other external systems if it is external.
  void collect(const sim::World& world, sim::ParticleSystemHandle system, const Vec3& centre, Real radius,
               Real start, Real end);
  /// Adds a new particle, with its state at its birth time [s].
  void add(const sim::Particle& particle, Real birth_time);

  /// Fills a table with the neighbours as they are at a time of the sub-step [s]. The table has room for
  /// about `count` more balls of at most `diameter` [m], and is in the frame `surface`, which moves with
  /// `carrier`.
  void place_into(Spacing& spacing, uint64_t count, Real diameter, Real time, const sim::Pose& carrier,
                  const sim::Pose& surface) const;

 private:
  /// A ball whose velocity is constant during the sub-step; `position` is that at its start.
  struct Ball {
    Vec3 position, velocity;
    Real radius;
  };

  void collect_from(const sim::ParticleArrays& particles, const Vec3& centre, Real radius, Real duration);

  Real start_ = 0;
  std::vector<Ball> balls_;
};

}  // namespace offstage::effects
