#pragma once
/// Particle systems as structures of arrays (physics P1), and the impulse of a collision of particles (P5).

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

/// One particle as it is created.
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
  /// Whether its particles collide with those of other systems that also have this flag.
  bool external = false;
  /// Whether contacts make particles rotate, as solid spheres: friction acts at their surface, so they roll.
  /// Otherwise they slide without rotating.
  bool rotates = false;
  bool dies_on_hit = false;        ///< whether particles are removed at their first collision
  bool report_collisions = false;  ///< whether collisions are reported as ParticleEvent
  bool report_deaths = false;      ///< whether deaths of age are reported as ParticleEvent
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

/// Figures of the particles in a step.
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

/// The state of one system. All arrays have the same order, that of creation; removal keeps it.
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

/// The impulse on body 1 in a collision of two bodies of effective mass m12 with the relative velocity u = v1
/// - v2 and the unit normal n, u.n < 0 (P5): restitution e along n. It sticks tangentially if the friction
/// cone allows; otherwise it slides with |P_t| = mu P_n against the sliding direction.
Vec3 collision_impulse(Real m12, const Vec3& u, const Vec3& n, Real restitution, Real friction);
/// The impulse of round bodies that rotate, with the effective mass `across` for impulses along the surface.
Vec3 collision_impulse(Real m12, Real across, const Vec3& u, const Vec3& n, Real restitution, Real friction);

/// m r^2 / I of a solid ball: an impulse across its surface moves the surface 1 + kBallTurning times as much
/// as the centre.
inline constexpr Real kBallTurning = 2.5;

/// A velocity scaled to the energy after a displacement by `shift` under an acceleration a: |v|^2 + 2
/// a.shift. A hit that was found on a straight path, or a surface in the way, puts a particle beside its
/// parabola; this conserves its energy. A particle at rest stays at rest.
Vec3 velocity_after_shift(const Vec3& v, const Vec3& a, const Vec3& shift);

/// Time until two spheres touch, which is when the distance of their centres is `distance` (P3). d and u are
/// the current differences of their centres and of their velocities. Zero if they overlap and approach; none
/// if they never touch.
std::optional<Real> meeting_time(const Vec3& d, const Vec3& u, Real distance);

}  // namespace offstage::sim
