#pragma once
/// Particle systems as structures of arrays (physics P1), and their impulse at one collision (P5).

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

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
  Real lifespan = 1e30;  ///< [s]; removed when its age reaches it
  Real restitution = 0.5;
  Real friction = 0.5;
  Real charge = 0;  ///< [C]
};

struct ParticleSystemDef {
  std::string name;
  Real linear_drag = 0;            ///< k_d of F = -k_d (v - wind) [kg/s]
  bool gravity = true;             ///< feels the world's gravity
  Vec3 force = Vec3::Zero();       ///< constant extra force per particle [N]
  bool collides = true;            ///< with bodies (the book's "complex" flag)
  bool internal = false;           ///< its particles collide with each other
  bool external = false;           ///< its particles collide with those of other systems that have this, too
  bool dies_on_hit = false;        ///< removed at its first collision
  bool report_collisions = false;  ///< as ParticleEvent
  bool report_deaths = false;      ///< of age, as ParticleEvent
  IntegratorKind integrator = IntegratorKind::leapfrog;
};

/// Something that happened to a particle in the last sub-step, for effects to answer to.
struct ParticleEvent {
  enum class Kind : uint8_t { collision, death };
  Kind kind = Kind::collision;
  ParticleSystemHandle system;
  uint64_t id = 0;
  Real time = 0;                 ///< of the world [s]
  Vec3 position = Vec3::Zero();  ///< of its centre [m]
  Vec3 velocity = Vec3::Zero();  ///< after it [m/s]
  Vec3 normal = Vec3::Zero();    ///< of what was hit, towards the particle; zero for a death
  Real mass = 0, radius = 0, age = 0;
};

/// The state of one system. Arrays run in parallel, in order of creation; removal keeps the order.
struct ParticleArrays {
  std::vector<Vec3> position, velocity;
  std::vector<Real> mass, radius, age, lifespan, restitution, friction, charge;
  std::vector<uint64_t> id;  ///< unique in its system, ascending, never reused

  std::size_t size() const { return position.size(); }
};

/// The impulse on body 1 of a collision of two bodies of effective mass m12 with relative velocity u = v1 -
/// v2 and unit normal n, u.n < 0 (P5): restitution e along n; sticks tangentially if the friction cone
/// allows, else slides with |P_t| = mu P_n against the sliding direction.
Vec3 collision_impulse(Real m12, const Vec3& u, const Vec3& n, Real restitution, Real friction);

/// A velocity scaled so that it has the energy of having come by `shift` farther than its time allows under
/// an acceleration a: |v|^2 + 2 a.shift. Where a hit, found on a straight path, or a surface in the way puts
/// a particle beside its parabola, the energy that this would take is kept so. At rest it stays at rest.
Vec3 velocity_after_shift(const Vec3& v, const Vec3& a, const Vec3& shift);

/// When two spheres come to touch whose centres are `distance` apart when they do (P3): d and u are the
/// present difference of their centres and of their velocities. Zero if they overlap and approach; none if
/// they never meet.
std::optional<Real> meeting_time(const Vec3& d, const Vec3& u, Real distance);

}  // namespace offstage::sim
