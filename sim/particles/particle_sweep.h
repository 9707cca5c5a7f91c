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
#include "sim/dynamics/body_impulses.h"
#include "sim/particles/particle_forces.h"

namespace offstage::sim {

/// A particle before and after integration without collisions; the sweep rewrites the end.
struct ParticlePath {
  Vec3 start, start_velocity;
  Vec3 end, end_velocity;
  Real mass, radius, restitution, friction;
};

struct SweepOutcome {
  uint32_t collisions = 0;    ///< impacts; a resting contact is not one
  bool hit = false;           ///< touched anything
  bool ejected = false;       ///< found inside a body, projected out (P4)
  bool trapped = false;       ///< found inside a body, could not be projected out (P4)
  bool truncated = false;     ///< used up its hits
  bool strikes_body = false;  ///< left as it was before, because it strikes a dynamic body ...
  Real time = 0;              ///< ... at this fraction of the sub-step
};

/// A collision of a particle, after it.
struct Strike {
  Real fraction;  ///< of the sub-step
  Vec3 position, velocity;
  Vec3 normal;  ///< of what was hit, towards the particle
};

/// What sweeps leave behind for others.
struct SweepLog {
  std::vector<Reaction> reactions;
  std::vector<Strike> strikes;  ///< of the particle swept last, if wanted
  bool wants_strikes = false;
};

/// Where a particle on its path comes to touch an obstacle.
struct ObstacleHit {
  const Obstacle* obstacle = nullptr;
  Real fraction = 1;  ///< of the sub-step
  Vec3 position;      ///< of the particle's centre
  Vec3 normal;        ///< of the obstacle
};

/// Impulse on a particle that meets an obstacle at a fraction of the sub-step with the relative velocity u,
/// u.n < 0 (P5, P8); `mobility`: of the obstacle at the contact, zero if it does not give way. `friction`
/// counts along the obstacle's friction axis; across it `cross_friction` of that, and each sticks or slides
/// by itself.
Vec3 collision_impulse(const Obstacle& o, Real fraction, Real particle_mass, const Vec3& u, const Vec3& n,
                       Real restitution, Real friction, const Mat3& mobility);
/// What an impulse on a particle does to the obstacle.
Reaction reaction(const Obstacle& o, const Vec3& contact, Real fraction, const Vec3& impulse_on_particle);

/// The obstacles that are near one particle's way.
class NearObstacles {
 public:
  NearObstacles(const Obstacles& fixed, const Obstacles& moving) : fixed_(fixed), moving_(moving) {}

  /// Looks for those that a sphere may touch on its way from a to b.
  void find(const Vec3& a, const Vec3& b, Real radius);
  std::span<const Obstacle* const> all() const { return near_; }

  /// Projects a sphere, to be at `start` at a fraction of the sub-step, out of the bodies that it is in,
  /// along the nearest face (P4); `end` moves with it. False if that does not succeed. `deep`: it was inside
  /// by more than rounding and straightened paths make. Those found must be those near `start` and `end`.
  bool eject(Vec3& start, Vec3& end, Real radius, Real fraction, bool& deep);
  /// Of those found, the first that a sphere meets on its way from a at a fraction of the sub-step to b at
  /// its end.
  ObstacleHit first_hit(const Vec3& a, const Vec3& b, Real radius, Real from) const;
  /// Where a sphere meets one; none if it does not before `latest`, a fraction of the sub-step.
  static ObstacleHit hit(const Obstacle& o, const Vec3& a, const Vec3& b, Real radius, Real from,
                         Real latest);

 private:
  const Obstacles& fixed_;
  const Obstacles& moving_;
  std::vector<const Obstacle*> near_;
};

class ParticleSweep {
 public:
  /// `fixed` and `moving` are the obstacles of a sub-step of length h [s]. Those that strike dynamic bodies
  /// change `impulses`, one after the other; without, as where many sweep at the same time, they are left as
  /// they were and reported (SweepOutcome::strikes_body).
  ParticleSweep(const Obstacles& fixed, const Obstacles& moving, const ParticleForces& forces, Real h,
                SweepLog& log, BodyImpulses* impulses = nullptr)
      : near_(fixed, moving), forces_(forces), h_(h), log_(log), impulses_(impulses) {}

  /// The particle lives from fraction `born` of the sub-step to its end. `extra` is the mean acceleration by
  /// forces beyond ParticleForces (springs).
  SweepOutcome operator()(ParticlePath& path, Real born, const Vec3& extra);

 private:
  /// A surface that presses on the particle until the end of the sub-step.
  struct Contact {
    Vec3 normal;
    const Obstacle* obstacle;
    Real friction;
    Real fraction;  // since when
    /// Its obstacle was struck and gives way, but not before the next sub-step: so long it only is in the
    /// way.
    bool gives_way;
  };

  bool was_struck(const Obstacle& o) const;
  bool respond(ParticlePath& path, const ObstacleHit& hit, Real from, const Vec3& extra,
               SweepOutcome& outcome);
  void finish(ParticlePath& path, Real duration, const Vec3& extra);
  void add_contact(const Contact& contact);
  Vec3 fly(const Vec3& v, Real mass, Real duration, const Vec3& extra) const;

  NearObstacles near_;
  const ParticleForces& forces_;
  Real h_;
  SweepLog& log_;
  BodyImpulses* impulses_;
  std::size_t reactions_before_finish_ = 0;
  std::array<Contact, 4> contacts_;
  std::size_t contact_count_ = 0;
};

}  // namespace offstage::sim
