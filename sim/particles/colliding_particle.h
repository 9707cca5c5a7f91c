#pragma once
/// A particle that collides with other particles (physics P3). Its path through the rest of a sub-step is a
/// straight line.

#include <cmath>
#include <cstdint>
#include <optional>

#include "sim/collision/obstacles.h"
#include "sim/contact/collision.h"
#include "sim/core/types.h"
#include "sim/dynamics/body_impulses.h"
#include "sim/particles/particles.h"

namespace offstage::sim {

struct CollidingParticle {
  Vec3 position;       ///< position at the start of its path
  Vec3 path_velocity;  ///< mean velocity along its path
  Vec3 velocity;       ///< velocity at the end of the sub-step
  Vec3 acceleration;   ///< mean acceleration by forces
  Real from;           ///< time at which the path starts, since the sub-step's start [s]
  Real mass, radius, restitution, friction;
  /// For a particle that rotates as a ball: `turning` is m r^2 / I (kBallTurning), and `surface_spin` is r
  /// times its angular velocity [m/s]. Otherwise both are zero.
  Real turning;
  Vec3 surface_spin;
  uint32_t system;          ///< number of its system
  bool internal, external;  ///< collision flags of its system; see ParticleSystemDef
  bool hits_bodies;
  /// The dynamic body on which the particle has pressed most in the last sub-step, and the speed of approach
  /// [m/s] that this contact ended.
  struct Carrier {
    uint32_t body = ~0u;
    Real speed = 0;
  };
  Carrier carrier = {};

  Vec3 at(Real t) const { return position + (t - from) * path_velocity; }
  /// Applies a change of velocity [m/s] by a collision at time t of a sub-step of length h [s]. The path
  /// continues from there under the same acceleration.
  void strike(Real t, Real h, const Vec3& change) {
    const Vec3 after = arrival(t, h) + change;
    position = at(t);
    velocity = after + (h - t) * acceleration;
    path_velocity = after + (h - t) / 2 * acceleration;
    from = t;
  }
  /// Changes the rotation by an impulse [N s] at the surface; the unit normal n points from the contact to
  /// the particle's centre.
  void turn(const Vec3& n, const Vec3& impulse) {
    if (turning > 0) surface_spin -= turning / mass * n.cross(impulse);
  }
  /// Angular velocity and inverse moment of inertia [1/(kg m^2)].
  Vec3 angular_velocity() const { return surface_spin / radius; }
  Real inverse_inertia() const { return turning / (mass * radius * radius); }
  Vec3 velocity_at(Real t, Real h) const { return velocity - (h - t) * acceleration; }
  /// Returns the velocity at time t, scaled so that the energy is right at the position at(t). This position
  /// is on the straight path and not on the parabola.
  Vec3 arrival(Real t, Real h) const {
    const Vec3 v = velocity_at(t, h);
    const Vec3 shift = (t - from) * (path_velocity - (velocity_at(from, h) + v) / 2);
    return velocity_after_shift(v, acceleration, shift);
  }
};

inline bool may_collide(const CollidingParticle& a, const CollidingParticle& b) {
  return a.system == b.system ? a.internal : a.external && b.external;
}

/// Restitution and friction of two particles, combined as for bodies.
inline Real pair_restitution(const CollidingParticle& a, const CollidingParticle& b) {
  return std::max(a.restitution, b.restitution);
}
inline Real pair_friction(Real a, Real b) {
  return std::sqrt(a * b);
}

/// Relative velocity of the surfaces of a and b at their contact due to rotation alone [m/s]. The unit normal
/// n points from b to a.
inline Vec3 rolling_velocity(const CollidingParticle& a, const CollidingParticle& b, const Vec3& n) {
  return n.cross(a.surface_spin + b.surface_spin);
}
/// Effective mass of two particles for impulses perpendicular to the contact normal [kg].
inline Real mass_across(const CollidingParticle& a, const CollidingParticle& b) {
  return 1 / ((1 + a.turning) / a.mass + (1 + b.turning) / b.mass);
}

/// Time at which two particles touch on their paths, since the sub-step's start [s], and the unit normal from
/// b to a.
struct Meeting {
  Real time;
  Vec3 normal;
};
inline std::optional<Meeting> meeting(const CollidingParticle& a, const CollidingParticle& b, Real h) {
  const Real from = std::max(a.from, b.from);
  const Vec3 d = a.at(from) - b.at(from), u = a.path_velocity - b.path_velocity;
  const auto after = meeting_time(d, u, a.radius + b.radius);
  if (!after || from + *after > h) return std::nullopt;
  const Vec3 apart = d + *after * u;
  const Real distance = apart.norm();
  if (!(distance > 0)) return Meeting{from, -u.normalized()};
  return Meeting{from + *after, apart / distance};
}

/// Parameters of a sub-step for the collisions of particles.
struct ParticleStep {
  Real h;  ///< length of the sub-step [s]
  const Obstacles& fixed;
  Obstacles& moving;  ///< bodies that particles push are displaced
  ImpactLaw law;
  Real collision_speed;    ///< slower contacts do not bounce [m/s]
  BodyImpulses& impulses;  ///< impulses on dynamic bodies
};

/// Whether an approach at `speed` [m/s] is an impact. Otherwise it is a resting contact: it is slower than
/// the collision speed plus the speed that forces cause within a sub-step. Contacts transmit forces;
/// therefore `acceleration` must be the greater acceleration of the two particles [m/s^2].
inline bool is_impact(Real speed, Real acceleration, const ParticleStep& step) {
  return speed > step.collision_speed + acceleration * step.h;
}
inline Real greater_acceleration(const CollidingParticle& a, const CollidingParticle& b) {
  return std::sqrt(std::max(a.acceleration.squaredNorm(), b.acceleration.squaredNorm()));
}

/// Returns the acceleration with which a particle may approach a body while it rests on it: that of the
/// particle or, if the body has carried it in the last sub-step, that which the contact has prevented.
/// Without the particle, a light body on a spring accelerates much.
inline Real greater_acceleration(const CollidingParticle& g, const Obstacle& o, Real h) {
  return std::max(g.acceleration.norm(), g.carrier.body == o.body ? g.carrier.speed / h : 0);
}

/// A collision of a particle, as reported to the caller. The velocity is the velocity after the collision.
struct ParticleStrike {
  uint32_t particle;
  Real time;  ///< time of the collision, since the sub-step's start [s]
  Vec3 position, velocity, normal;
};

}  // namespace offstage::sim
