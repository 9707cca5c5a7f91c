#pragma once
/// The forces of a scene; see scene.h. Forces have the names of the objects on which they act; without names
/// they act on all dynamic bodies, all cloths and no particles.

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
/// The objects on which a force acts, and its time.
struct ForceScope : NamedForce {
  std::vector<std::string> bodies;
  std::vector<std::string> particles;  ///< names of groups, of emitters, or of their child particles
  std::vector<std::string> cloths;
  Real start = 0;
  Real end = 1e30;
};
/// Fields also have a region.
struct FieldScope : ForceScope {
  sim::Region region;
  int drop_rate = 0;  ///< exponent of the decrease from 1 in the middle of the region to 0 at its edge
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

/// Keys of forces between particles.
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
/// A damped spring of length 0 from a body or from particles to a moving point, as of a hand.
struct Grab : NamedForce {
  std::string body;
  std::vector<std::string> particles;
  std::vector<std::string> cloths;
  Vec3 point = Vec3::Zero();  ///< point of the body, in its frame
  std::vector<HandKey> keyframes;
  sim::Interpolation interpolation = sim::Interpolation::monotone;
  Real stiffness = 100;
  Real damping = 10;
  /// Greatest distance of particles and of cloth points [m]; the default is the greatest length of a scene:
  /// all of them.
  Real reach = 1e9;
  Real start = 0;
  Real end = 1e30;
};
enum class ForceAxes { world, body };
struct AppliedKey {
  Real time = 0;
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  std::optional<sim::Interpolation> interpolation;  ///< to the next key; default: the force's
};
/// A force at a point of bodies, and a torque.
struct AppliedForce : NamedForce {
  std::vector<std::string> bodies;
  std::optional<Vec3> point;  ///< in the body's frame; default: the centre of mass
  ForceAxes axes = ForceAxes::world;
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();  ///< without keyframes
  std::vector<AppliedKey> keyframes;
  sim::Interpolation interpolation = sim::Interpolation::linear;
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
                           TurbulenceField, GravitationForce, CoulombForce, LennardJonesForce, AppliedForce>;

/// The part that every force has.
NamedForce& named(Force& force);
const NamedForce& named(const Force& force);

}  // namespace offstage::producer
