#pragma once
/// Definition and state of particle systems (physics P1), and the impulse of a particle's collision (P5).

#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "sim/core/figures.h"
#include "sim/core/handle.h"
#include "sim/core/types.h"
#include "sim/dynamics/integrator.h"

namespace offstage::sim {

struct ParticleSystemTag {};
using ParticleSystemHandle = Handle<ParticleSystemTag>;

/// The state in which a particle is created.
struct Particle {
  Vec3 position = Vec3::Zero();
  Vec3 velocity = Vec3::Zero();
  Real mass = 1;         ///< [kg], > 0
  Real radius = 0.01;    ///< [m], > 0
  Real lifespan = 1e30;  ///< age at which it is removed [s]
  Real restitution = 0.5;
  Real friction = 0.5;
  Real charge = 0;                       ///< [C]
  Vec3 angular_velocity = Vec3::Zero();  ///< world [rad/s]; only in a system that `rotates`
};

struct ParticleSystemDef {
  std::string name;
  Real linear_drag = 0;       ///< k_d of F = -k_d (v - wind) [kg/s]
  bool gravity = true;        ///< whether the world's gravity acts on the particles
  Vec3 force = Vec3::Zero();  ///< constant extra force per particle [N]
  bool collides = true;       ///< whether its particles collide with bodies (the book's "complex" flag)
  bool internal = false;      ///< whether its particles collide with each other
  /// Whether its particles collide with particles of other systems that also have this flag.
  bool external = false;
  /// Whether contacts make particles rotate, as solid spheres: friction acts at their surface, so they roll.
  /// Otherwise they slide without rotating.
  bool rotates = false;
  bool dies_on_hit = false;        ///< whether particles are removed at their first collision
  bool report_collisions = false;  ///< whether collisions are reported as ParticleEvent
  bool report_deaths = false;  ///< whether particles that reach their lifespan are reported as ParticleEvent
  IntegratorKind integrator = IntegratorKind::leapfrog;
};

/// An event of a particle in the last sub-step, to which effects can react.
struct ParticleEvent {
  enum class Kind : uint8_t { collision, death };
  Kind kind = Kind::collision;
  ParticleSystemHandle system;
  uint64_t id = 0;
  Real time = 0;                 ///< time of the event, on the world's clock [s]
  Vec3 position = Vec3::Zero();  ///< centre of the particle [m]
  Vec3 velocity = Vec3::Zero();  ///< velocity after the event [m/s]
  Vec3 normal = Vec3::Zero();    ///< normal of the surface hit, towards the particle; zero for a death
  Real mass = 0, radius = 0, age = 0;
};

/// Statistics of all particles in a step.
struct ParticleFigures {
  uint64_t born = 0;
  uint64_t expired = 0;     ///< particles that reached their lifespan or were removed by a collision
  uint64_t retired = 0;     ///< particles that left the world's bounds
  uint64_t ejected = 0;     ///< particles found inside a body and projected out (P4)
  uint64_t removed = 0;     ///< particles found inside a body that could not be projected out (P4)
  uint64_t collisions = 0;  ///< collisions with bodies and particles
  uint64_t truncated = 0;   ///< particles that reached the limit of collisions in one sub-step

  static constexpr auto figures() {
    using T = ParticleFigures;
    return std::tuple(Figure("particles_born", &T::born), Figure("particles_expired", &T::expired),
                      Figure("particles_retired", &T::retired), Figure("particles_ejected", &T::ejected),
                      Figure("particles_removed", &T::removed), Figure("particle_collisions", &T::collisions),
                      Figure("truncated_sweeps", &T::truncated));
  }
  void add(const ParticleFigures& more) { add_figures(*this, more); }
};

/// The state of one system. All arrays are in the order of creation, also after removals.
struct ParticleArrays {
  std::vector<Vec3> position, velocity;
  std::vector<Real> mass, radius, age, lifespan, restitution, friction, charge;
  std::vector<uint64_t> id;  ///< ids of the particles: unique in the system, ascending, never reused
  /// Angular velocity in the world [rad/s], and the rotation since the particle's creation. Both are empty
  /// unless the system `rotates`.
  std::vector<Vec3> angular_velocity;
  std::vector<Quat> orientation;

  std::size_t size() const { return position.size(); }
};

/// Returns the impulse on body 1 in a collision of two bodies [N s] (physics P5). m12: effective mass [kg]. u
/// = v1 - v2: relative velocity, u.n < 0 [m/s]. n: unit normal. The contact sticks if the friction cone
/// allows it; otherwise |P_t| = mu P_n against the sliding direction.
Vec3 collision_impulse(Real m12, const Vec3& u, const Vec3& n, Real restitution, Real friction);
/// Returns the same impulse for round bodies that rotate. `across`: effective mass for tangential impulses
/// [kg].
Vec3 collision_impulse(Real m12, Real across, const Vec3& u, const Vec3& n, Real restitution, Real friction);

/// m r^2 / I of a solid ball. A tangential impulse changes the velocity of the surface 1 + kBallTurning times
/// as much as the velocity of the centre.
inline constexpr Real kBallTurning = 2.5;

/// Returns v scaled so that its square is |v|^2 + 2 a.shift. This conserves the energy of a particle that is
/// displaced by `shift` [m] under an acceleration a [m/s^2], for example when a hit on a straight path puts
/// it at a point next to its parabola. A particle at rest stays at rest.
Vec3 velocity_after_shift(const Vec3& v, const Vec3& a, const Vec3& shift);

/// Returns the time until the distance of two centres is `distance` [s], when the two spheres touch (physics
/// P3). d: difference of the centres [m]; u: difference of the velocities [m/s]. The result is zero if they
/// overlap and approach, and empty if they never touch.
std::optional<Real> meeting_time(const Vec3& d, const Vec3& u, Real distance);

}  // namespace offstage::sim
