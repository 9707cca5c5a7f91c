#pragma once
/// Particle systems as structures of arrays (physics P1), and their impulse at one collision (P5).

#include <cstdint>
#include <string>
#include <vector>

#include "sim/dynamics/integrator.h"
#include "sim/types.h"

namespace offstage::sim {

/// One particle as it is created.
struct Particle {
  Vec3 position = Vec3::Zero();
  Vec3 velocity = Vec3::Zero();
  Real mass = 1;         ///< [kg], > 0
  Real radius = 0.01;    ///< [m], > 0
  Real lifespan = 1e30;  ///< [s]; removed when its age reaches it
  Real restitution = 0.5;
  Real friction = 0.5;
};

struct ParticleSystemDef {
  std::string name;
  Real linear_drag = 0;       ///< k_d of F = -k_d (v - wind) [kg/s]
  bool gravity = true;        ///< feels the world's gravity
  Vec3 force = Vec3::Zero();  ///< constant extra force per particle [N]
  bool collides = true;       ///< with bodies (the book's "complex" flag)
  bool dies_on_hit = false;   ///< removed at its first collision
  IntegratorKind integrator = IntegratorKind::symplectic_euler;
};

/// The state of one system. Arrays run in parallel, in order of creation; removal keeps the order.
struct ParticleArrays {
  std::vector<Vec3> position, velocity;
  std::vector<Real> mass, radius, age, lifespan, restitution, friction;
  std::vector<uint64_t> id;  ///< unique in its system, ascending, never reused

  std::size_t size() const { return position.size(); }
};

/// The impulse on body 1 of a collision of two bodies of effective mass m12 with relative velocity u = v1 -
/// v2 and unit normal n, u.n < 0 (P5): restitution e along n; sticks tangentially if the friction cone
/// allows, else slides with |P_t| = mu P_n against the sliding direction.
Vec3 collision_impulse(Real m12, const Vec3& u, const Vec3& n, Real restitution, Real friction);

}  // namespace offstage::sim
