#pragma once
/// Moves one particle through a sub-step among obstacles (physics P3-P5). The integrated path is swept
/// against the bodies, in each body's own frame between its poses, so that neither a fast particle nor a
/// moving body passes through the other. At a hit the particle is placed at the surface and its velocity is
/// changed by the impulse. It then continues for the remaining time under the same forces. Cloths are
/// obstacles, too (physics F9).

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sim/collision/obstacles.h"
#include "sim/dynamics/body_impulses.h"
#include "sim/particles/cloth_obstacles.h"
#include "sim/particles/particle_forces.h"

namespace offstage::sim {

/// State of a particle before and after the integration without collisions [m], [m/s]. The sweep replaces the
/// state after it.
struct ParticlePath {
  Vec3 start, start_velocity;
  Vec3 end, end_velocity;
  Real mass, radius, restitution, friction;
};

struct SweepOutcome {
  uint32_t collisions = 0;  ///< number of impacts; resting contacts do not count
  bool hit = false;         ///< whether the particle touched anything
  bool ejected = false;     ///< whether the particle was inside a body and was projected out (P4)
  bool trapped = false;     ///< whether the particle was inside a body and could not be projected out (P4)
  bool truncated = false;   ///< whether the particle reached the limit of collisions
  /// Whether the particle hits a dynamic body or cloth at the fraction `time`, and its path was therefore
  /// left unchanged; see ParticleSweep().
  bool strikes_body = false;
  Real time = 0;  ///< time of that hit, as a fraction of the sub-step
};

/// A collision of a particle, with the state after it.
struct Strike {
  Real fraction;  ///< time as a fraction of the sub-step
  Vec3 position, velocity;
  Vec3 normal;  ///< normal of the obstacle, towards the particle
};

/// Further results of sweeps: impulses on bodies, and collisions.
struct SweepLog {
  std::vector<Reaction> reactions;
  std::vector<Strike> strikes;  ///< collisions of the last particle, if requested
  bool wants_strikes = false;
};

/// First contact of a particle on its path with an obstacle.
struct ObstacleHit {
  const Obstacle* obstacle = nullptr;
  Real fraction = 1;  ///< time as a fraction of the sub-step
  Vec3 position;      ///< position of the particle's centre
  Vec3 normal;        ///< normal of the obstacle
};

/// The plane in which a particle touches an obstacle, moved with the obstacle to the end of the sub-step.
struct PlaneAtEnd {
  PlaneAtEnd() = default;
  explicit PlaneAtEnd(const ObstacleHit& hit);
  /// Height of a point above the plane [m]; 0 for a particle's centre at the hit.
  Real height(const Vec3& point) const { return normal.dot(point - origin); }
  Vec3 origin, normal;
};

/// Returns the impulse on a particle [N s] that hits an obstacle at a fraction of the sub-step (physics P5,
/// P8). `u`: velocity relative to the solid, u.n < 0; for friction, the velocity relative to the conveyed
/// surface counts (Obstacle::surface_velocity). `mobility`: mobility of the obstacle at the contact [1/kg];
/// zero if the particle does not move it. `friction` applies along the obstacle's friction axis, and
/// `friction` times Obstacle::cross_friction across it. With a friction axis each direction sticks or slides
/// separately. `turning`: CollidingParticle::turning.
Vec3 collision_impulse(const Obstacle& o, Real fraction, Real particle_mass, const Vec3& u, const Vec3& n,
                       Real restitution, Real friction, const Mat3& mobility, Real turning = 0);
/// Returns the reaction on an obstacle to an impulse on a particle at the point `contact` (world) at a
/// fraction of the sub-step.
Reaction reaction(const Obstacle& o, const Vec3& contact, Real fraction, const Vec3& impulse_on_particle);

/// Path of a sphere's centre from a fraction of the sub-step to its end.
class SpherePath {
 public:
  /// A path from a to b, which is straight in the frame of `carrier` or, if it is null, in the world. A
  /// particle that rests on a turning body or slides along it stays on its surface only in the body's frame.
  SpherePath(const Vec3& a, const Vec3& b, Real from, const Obstacle* carrier = nullptr);

  /// Position after a fraction of the path.
  Vec3 at(Real fraction) const;
  /// Position after a fraction of the path, in the frame of an obstacle.
  Vec3 in_frame(const Obstacle& o, Real fraction) const;
  /// Returns the number of pieces that are almost straight in the frame of an obstacle; see Obstacle::pieces.
  int pieces(const Obstacle& o, Real radius) const;
  /// Returns by how much the path deviates from its chord, at most [m].
  Real bend() const;
  /// Returns the fraction of the sub-step at a fraction of the path.
  Real time(Real fraction) const { return from_ + fraction * (1 - from_); }

  const Vec3& first() const { return a_; }
  const Vec3& last() const { return b_; }

 private:
  Vec3 a_, b_;
  Real from_;
  const Obstacle* carrier_;
  Vec3 local_a_ = Vec3::Zero(), local_b_ = Vec3::Zero();  ///< in the frame of the carrier
};

/// The obstacles near one particle's path.
class NearObstacles {
 public:
  NearObstacles(const Obstacles& fixed, const Obstacles& moving) : fixed_(fixed), moving_(moving) {}

  /// Finds the obstacles that a sphere may touch on its path from a to b.
  void find(const Vec3& a, const Vec3& b, Real radius) { find(SpherePath(a, b, 0), radius); }
  void find(const SpherePath& path, Real radius);
  std::span<const Obstacle* const> all() const { return near_; }

  /// Projects a sphere out of the bodies that contain it, along the nearest face (P4). `start` is its
  /// position at a fraction of the sub-step; `end` is moved by the same displacement. Returns false if this
  /// fails. `deep` is set if the sphere was deeper inside than errors of rounding and of straight paths can
  /// explain. find() must have been called for `start` and `end`.
  bool eject(Vec3& start, Vec3& end, Real radius, Real fraction, bool& deep);
  /// Returns the first hit of a sphere on its path, among the obstacles found.
  ObstacleHit first_hit(const SpherePath& path, Real radius) const;
  /// Returns the hit of a sphere with one obstacle. ObstacleHit::obstacle is null if there is no hit before
  /// `latest`, a fraction of the sub-step.
  static ObstacleHit hit(const Obstacle& o, const SpherePath& path, Real radius, Real latest);

 private:
  const Obstacles& fixed_;
  const Obstacles& moving_;
  std::vector<const Obstacle*> near_;
};

class ParticleSweep {
 public:
  /// `fixed` and `moving` are the obstacles, and `cloths` the cloths, of a sub-step of length h [s]. With
  /// `impulses`, each hit of a dynamic body or of cloth changes its velocity immediately, so particles must
  /// be swept one after the other. Without `impulses`, particles can be swept in parallel; those that hit a
  /// dynamic body or cloth are left unchanged and reported by SweepOutcome::strikes_body.
  ParticleSweep(const Obstacles& fixed, const Obstacles& moving, ClothObstacles& cloths,
                const ParticleForces& forces, Real h, SweepLog& log, BodyImpulses* impulses = nullptr)
      : near_(fixed, moving),
        cloths_(cloths.empty() ? nullptr : &cloths),
        forces_(forces),
        h_(h),
        log_(log),
        impulses_(impulses) {}

  /// Sweeps a particle that exists from fraction `born` of the sub-step to its end. `extra` is the mean
  /// acceleration by forces beyond ParticleForces (springs).
  SweepOutcome operator()(ParticlePath& path, Real born, const Vec3& extra);

 private:
  /// A surface against which the particle presses until the end of the sub-step.
  struct Contact {
    Vec3 normal;  // at the start of the contact
    PlaneAtEnd plane;
    const Obstacle* obstacle;
    Real friction;
    Real fraction;  // start of the contact
    /// Whether the obstacle was hit and will move away only in the next sub-step. Until then it blocks the
    /// particle.
    bool gives_way;
  };

  /// Contact with cloth until the end of the sub-step.
  struct ClothContact {
    ClothObstacles::Hit hit;
    bool presses = false;         // whether the particle does not bounce
    Vec3 impulse = Vec3::Zero();  // on the particle after the hit, not yet applied to the cloth [N s]
  };

  SweepOutcome sweep(ParticlePath& path, Real born, const Vec3& extra);
  bool was_struck(const Obstacle& o) const;
  bool eject(ParticlePath& path, Real born, SweepOutcome& outcome);
  Vec3 arrival(const ParticlePath& path, const Vec3& position, Real duration, const Vec3& extra) const;
  bool respond(ParticlePath& path, const ClothObstacles::Hit& hit, Real from, const Vec3& extra,
               SweepOutcome& outcome);
  void add_contact(const ClothContact& contact);
  bool press_cloth(ClothContact& contact, Vec3& v, Real mass, Real friction) const;
  void keep_off_cloth(ParticlePath& path, const Vec3& extra);
  bool respond(ParticlePath& path, const ObstacleHit& hit, Real from, const Vec3& extra,
               SweepOutcome& outcome);
  void finish(ParticlePath& path, Real duration, const Vec3& extra);
  void stay_before(const Contact& contact, ParticlePath& path, Real duration, const Vec3& extra) const;
  std::span<ClothContact> cloth_contacts() { return std::span(cloth_contacts_).first(cloth_contact_count_); }
  void add_contact(const Contact& contact);
  Vec3 fly(const Vec3& v, Real mass, Real duration, const Vec3& extra) const;

  NearObstacles near_;
  ClothObstacles* cloths_;  ///< null if there are none
  const ParticleForces& forces_;
  Real h_;
  SweepLog& log_;
  BodyImpulses* impulses_;
  /// The turning obstacle in whose frame the rest of the path is straight; null: none.
  const Obstacle* carrier_ = nullptr;
  std::size_t reactions_before_finish_ = 0;
  std::array<Contact, 4> contacts_;
  std::size_t contact_count_ = 0;
  std::array<ClothContact, 4> cloth_contacts_;
  std::size_t cloth_contact_count_ = 0;
};

}  // namespace offstage::sim
