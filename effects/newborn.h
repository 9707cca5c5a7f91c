#pragma once
/// Private: how the parameters of a newborn particle are drawn.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "effects/distribution.h"
#include "effects/random.h"
#include "sim/world.h"

namespace offstage::effects {

/// What a random number is drawn for. Values are part of every scene's result: append, never renumber.
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
  kBurst,  // + its place in the list
  kCharge = 1u << 16,
  kTurn,  // and the two after it
  kAge = kTurn + 3,
  kDelay,
  kPercent,  // of the parent's velocity
  kChance,
  kHeight,
  kPlace = 1u << 20,  // + 3 times the try, and the two after it
};

/// The numbers one particle, or one release, is made of.
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

/// A particle but for its place and velocity. `Def` has the parameters of physics F2.
template <class Def>
sim::Particle drawn_particle(const Def& def, const Draws& draw) {
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

/// The directions about an axis: a right-handed frame of unit vectors.
struct Cone {
  Vec3 axis, tangent;

  /// At a drawn angle from the axis, all around.
  Vec3 drawn(const Varying& spread_deg, const Draws& draw) const {
    const SinCos spread = sincos(draw(spread_deg, kSpread) * (std::numbers::pi / 180));
    const SinCos azimuth = sincos(2 * std::numbers::pi * draw.uniform(kAzimuth));
    return spread.cos * axis + spread.sin * (azimuth.cos * tangent + azimuth.sin * tangent.cross(axis));
  }
};

/// Nearest count to a drawn number, in [0, 1e9].
uint64_t rounded(Real x);

/// Adds a particle that was born at `birth` during a sub-step from `start` to `end`, or before it: then it
/// has flown straight since. False if it is dead by then.
bool add_newborn(sim::World& world, sim::ParticleSystemHandle system, sim::Particle particle, Real birth,
                 Real start, Real end);

}  // namespace offstage::effects
