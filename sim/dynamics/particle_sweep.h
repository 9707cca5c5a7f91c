#pragma once
/// Takes one particle through a sub-step among obstacles (physics P3-P5): the path that integration gave is
/// swept against the bodies, in each body's own frame between its poses, so that neither a fast particle nor
/// a moving body passes through the other. At a hit the particle is placed at the surface, gets its impulse,
/// and spends the remaining time with its new velocity under the same forces.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/collision/obstacles.h"
#include "sim/dynamics/particle_forces.h"

namespace offstage::sim {

/// A particle before and after integration without collisions; the sweep rewrites the end.
struct ParticlePath {
  Vec3 start, start_velocity;
  Vec3 end, end_velocity;
  Real mass, radius, restitution, friction;
};

struct SweepOutcome {
  uint32_t collisions = 0;  ///< impacts; a resting contact is not one
  bool hit = false;         ///< touched anything
  bool ejected = false;     ///< found inside a body, projected out (P4)
  bool trapped = false;     ///< found inside a body, could not be projected out (P4)
  bool truncated = false;   ///< used up its hits
};

class ParticleSweep {
 public:
  /// `fixed` and `moving` are the obstacles of a sub-step of length h [s].
  ParticleSweep(const Obstacles& fixed, const Obstacles& moving, const ParticleForces& forces, Real h)
      : fixed_(fixed), moving_(moving), forces_(forces), h_(h) {}

  /// The particle lives from fraction `born` of the sub-step to its end. `extra` is the mean acceleration by
  /// forces beyond ParticleForces (springs).
  SweepOutcome operator()(ParticlePath& path, Real born, const Vec3& extra);

 private:
  struct Hit {
    const Obstacle* obstacle = nullptr;
    Real fraction = 1;  // of the sub-step
    Vec3 position;      // of the particle's centre
    Vec3 normal;
  };
  /// A surface that presses on the particle until the end of the sub-step.
  struct Contact {
    Vec3 normal;
    const Obstacle* obstacle;
    Real friction;
  };

  void collect_near(const Vec3& a, const Vec3& b, Real radius);
  bool eject(ParticlePath& path, Real fraction, SweepOutcome& outcome);
  Hit first_hit(const ParticlePath& path, Real from) const;
  void sweep_obstacle(const Obstacle& o, const ParticlePath& path, Real from, Hit& first) const;
  void respond(ParticlePath& path, const Hit& hit, Real from, const Vec3& extra, SweepOutcome& outcome);
  void finish(ParticlePath& path, Real duration, const Vec3& extra);
  Vec3 fly(const Vec3& v, Real mass, Real duration, const Vec3& extra) const;

  const Obstacles& fixed_;
  const Obstacles& moving_;
  const ParticleForces& forces_;
  Real h_;
  std::vector<const Obstacle*> near_;
  std::array<Contact, 4> contacts_;
  std::size_t contact_count_ = 0;
};

}  // namespace offstage::sim
