#pragma once
/// The forces of a scene; see scene.h. Those that can act on many have the names of what they act on; none:
/// all dynamic bodies, all cloths and no particles.

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "producer/scene/values.h"
#include "sim/dynamics/interpolation.h"
#include "sim/dynamics/pair_law.h"
#include "sim/dynamics/region.h"
#include "sim/dynamics/turbulence.h"

namespace offstage::producer {

struct NamedForce {
  Where where;
  std::string name;
};
/// Whom it acts on, and when.
struct ForceScope : NamedForce {
  std::vector<std::string> bodies;
  std::vector<std::string> particles;  ///< names of groups, of emitters, or of their child particles
  std::vector<std::string> cloths;
  Real start = 0;
  Real end = 1e30;
};
/// What fields have: also where they act.
struct FieldScope : ForceScope {
  sim::Region region;
  int drop_rate = 0;  ///< power of the fall from 1 in the middle of the region to 0 at its edge
};
struct ConstantField : FieldScope {
  Vec3 force = Vec3::Zero();
};
struct PointField : FieldScope {
  Vec3 point = Vec3::Zero();
  Real force = 1;  ///< towards the point; negative: away from it
};
struct WindField : FieldScope {
  Vec3 wind = Vec3::Zero();
  Real drag = 1;
};
struct VortexField : FieldScope {
  Vec3 point = Vec3::Zero();
  Vec3 axis = Vec3::UnitY();
  Real circulation = 1;
  Real radius = 0.1;
  Real drag = 0;
};
struct TurbulenceField : FieldScope {
  Real speed = 1;
  Real scale = 1;
  int octaves = 2;
  Real lifetime = 0;
  Vec3 drift = Vec3::Zero();
  int seed = 0;
  Real drag = 0;
};

/// What forces between particles have.
struct PairScope : NamedForce {
  std::vector<std::string> particles;
  Real start = 0;
  Real end = 1e30;
  Real cut_off = 0;
  sim::Region region;
  int drop_rate = 0;
};
struct GravitationForce : PairScope {
  Real constant = 6.672e-11;
  Real softening = 0;
};
struct CoulombForce : PairScope {
  Real constant = 8.9875e9;
  Real softening = 0;
};
struct LennardJonesForce : PairScope {
  Real epsilon = 1;
  Real sigma = 0.01;
};

struct HandKey {
  Real time = 0;
  Vec3 position = Vec3::Zero();
  std::optional<sim::Interpolation> interpolation;  ///< to the next key; default: the grab's
};
/// A damped spring of no length from a body or from particles to a point that moves, as of a hand.
struct Grab : NamedForce {
  std::string body;
  std::vector<std::string> particles;
  std::vector<std::string> cloths;
  Vec3 point = Vec3::Zero();  ///< of the body, in its frame
  std::vector<HandKey> keyframes;
  sim::Interpolation interpolation = sim::Interpolation::monotone;
  Real stiffness = 100;
  Real damping = 10;
  Real reach = 1e9;  ///< of particles and of points of cloths [m]; the longest length of a scene: all of them
  Real start = 0;
  Real end = 1e30;
};
struct Explosion : NamedForce {
  std::vector<std::string> bodies;
  std::vector<std::string> particles;
  std::vector<std::string> cloths;
  Real time = 0;
  Vec3 point = Vec3::Zero();
  Real impulse = 1;
  Real radius = 1;
  int drop_rate = 1;
};
using Force = std::variant<ConstantField, PointField, WindField, Grab, Explosion, VortexField,
                           TurbulenceField, GravitationForce, CoulombForce, LennardJonesForce>;

/// What every force has.
NamedForce& named(Force& force);
const NamedForce& named(const Force& force);

}  // namespace offstage::producer
