#pragma once
/// Private: drawing the parameters of a new particle.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "effects/distribution.h"
#include "effects/new_particles.h"
#include "effects/random.h"
#include "sim/world.h"

namespace offstage::effects {

/// The purpose of a random number. The values affect the result of every scene: append new ones, never
/// renumber.
enum Property : uint32_t {
  kRate,
  kCount,
  kInterval,
  kSpeed,
  kSpread,
  kAzimuth,
  kRadius,
  kDensity,
  kMass,
  kLifespan,
  kRestitution,
  kFriction,
  kBurst,  // plus the index in the list
  kCharge = 1u << 16,
  kTurn,  // and the next two values
  kAge = kTurn + 3,
  kDelay,
  kPercent,  // percentage of the parent's velocity
  kChance,
  kHeight,
  kPlace = 1u << 20,  // plus 3 times the number of the try, and the next two values
};

/// The random numbers of one particle or one release.
class Draws {
 public:
  Draws(const RandomStream& random, uint64_t index, Real time)
      : random_(random), index_(index), time_(time) {}

  Real operator()(const Varying& v, uint32_t property) const {
    if (const Real* constant = std::get_if<Real>(&v)) return *constant;
    return sample(v, random_.uniform(index_, property), time_);
  }
  Real uniform(uint32_t property) const { return random_.uniform(index_, property); }
  std::array<Real, 3> uniforms(uint32_t property) const {
    return {uniform(property), uniform(property + 1), uniform(property + 2)};
  }

 private:
  const RandomStream& random_;
  uint64_t index_;
  Real time_;
};

/// A particle with random parameters, without position and velocity.
inline sim::Particle drawn_particle(const NewParticles& def, const Draws& draw) {
  sim::Particle p;
  p.radius = draw(def.radius, kRadius);
  p.lifespan = draw(def.lifespan, kLifespan);
  p.restitution = std::clamp(draw(def.restitution, kRestitution), 0.0, 1.0);
  p.friction = std::max(0.0, draw(def.friction, kFriction));
  p.mass = draw(def.mass, kMass);
  if (!(p.mass > 0))
    p.mass = draw(def.density, kDensity) * 4 / 3 * std::numbers::pi * p.radius * p.radius * p.radius;
  p.charge = draw(def.charge, kCharge);
  return p;
}

/// Random directions about an axis. `axis` and `tangent` are perpendicular unit vectors.
struct Cone {
  Vec3 axis, tangent;

  /// Returns a direction at the angle `spread_deg` [degrees] from the axis, with a uniformly random azimuth.
  Vec3 drawn(const Varying& spread_deg, const Draws& draw) const {
    const SinCos spread = sincos(draw(spread_deg, kSpread) * (std::numbers::pi / 180));
    const SinCos azimuth = sincos(2 * std::numbers::pi * draw.uniform(kAzimuth));
    return spread.cos * axis + spread.sin * (azimuth.cos * tangent + azimuth.sin * tangent.cross(axis));
  }
};

/// Returns the nearest integer, clamped to [0, 1e9].
uint64_t rounded(Real x);

/// Adds a particle that was created at `birth_time`, during the sub-step from `start` to `end` or before it
/// [s]. In the second case it has moved on a straight line until `start`. Returns false if its lifespan has
/// already ended.
bool add_new_particle(sim::World& world, sim::ParticleSystemHandle system, sim::Particle particle,
                      Real birth_time, Real start, Real end);

}  // namespace offstage::effects
