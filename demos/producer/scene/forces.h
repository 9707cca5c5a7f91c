#pragma once
/// The forces of a scene; see scene.h. Forces have the names of the objects on which they act; without names
/// they act on all dynamic bodies, all cloths and no particles.

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "producer/scene/values.h"
#include "sim/dynamics/force_field.h"
#include "sim/dynamics/interpolation.h"

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
/// A field of the simulation with the objects on which it acts.
template <class E>
struct FieldOf : ForceScope, E {
  using Effect = E;
};
struct ConstantField : FieldOf<sim::ConstantField> {};
struct PointField : FieldOf<sim::PointField> {
  PointField() { force = 1; }
};
struct WindField : FieldOf<sim::WindField> {
  WindField() { drag = 1; }
};
struct VortexField : FieldOf<sim::Vortex> {};
struct TurbulenceField : FieldOf<sim::Turbulence> {};

/// A force between particles, and the systems of these particles.
template <class E>
struct PairForceOf : NamedForce, E {
  using Effect = E;
  std::vector<std::string> particles;
  Real start = 0;
  Real end = 1e30;
};
struct GravitationForce : PairForceOf<sim::MutualGravitation> {};
struct CoulombForce : PairForceOf<sim::Coulomb> {};
struct LennardJonesForce : PairForceOf<sim::LennardJones> {};

struct HandKey {
  Real time = 0;
  Vec3 position = Vec3::Zero();
  /// Interpolation to the next key; default: the interpolation of the grab.
  std::optional<sim::Interpolation> interpolation;
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
  /// Interpolation to the next key; default: the interpolation of the force.
  std::optional<sim::Interpolation> interpolation;
};
/// A force at a point of bodies, and a torque.
struct AppliedForce : NamedForce {
  std::vector<std::string> bodies;
  std::optional<Vec3> point;  ///< point of application in the body's frame; default: the centre of mass
  ForceAxes axes = ForceAxes::world;
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();  ///< force and torque, if there are no keyframes
  std::vector<AppliedKey> keyframes;
  sim::Interpolation interpolation = sim::Interpolation::linear;
  Real start = 0;
  Real end = 1e30;
};
struct Explosion : NamedForce, sim::Explosion {
  using Effect = sim::Explosion;
  std::vector<std::string> bodies;
  std::vector<std::string> particles;
  std::vector<std::string> cloths;
  Real time = 0;
};
using Force = std::variant<ConstantField, PointField, WindField, Grab, Explosion, VortexField,
                           TurbulenceField, GravitationForce, CoulombForce, LennardJonesForce, AppliedForce>;

/// The part that every force has.
NamedForce& named(Force& force);
const NamedForce& named(const Force& force);

}  // namespace offstage::producer
