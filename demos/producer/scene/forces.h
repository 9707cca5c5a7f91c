#pragma once
/// The forces of a scene; see scene.h. A force lists the names of the objects on which it acts. A force
/// without any names acts on all dynamic bodies and all cloths, but on no particles.

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
/// The objects on which a force acts, and the time span in which it acts.
struct ForceScope : NamedForce {
  std::vector<std::string> bodies;
  std::vector<std::string> particles;  ///< names of particle groups, emitters or child particles
  std::vector<std::string> cloths;
  Real start = 0;
  Real end = 1e30;
};
/// A force field `E` of the simulation, together with the objects on which it acts.
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

/// A force `E` between pairs of particles, together with the names of their particle systems.
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

/// Position of the hand of a Grab at one time, in the world.
struct HandKey {
  Real time = 0;
  Vec3 position = Vec3::Zero();
  /// Interpolation to the next key; default: the interpolation of the grab.
  std::optional<sim::Interpolation> interpolation;
};
/// A damped spring with rest length 0 that pulls a body, particles or cloths to a moving point, as a hand
/// would.
struct Grab : NamedForce {
  std::string body;
  std::vector<std::string> particles;
  std::vector<std::string> cloths;
  Vec3 point = Vec3::Zero();  ///< point at which the body is held, in the body's frame
  std::vector<HandKey> keyframes;
  sim::Interpolation interpolation = sim::Interpolation::monotone;
  Real stiffness = 100;
  Real damping = 10;
  /// Greatest distance at which particles and cloth points are grabbed [m]. The default is the greatest
  /// length in a scene, so all of them are grabbed.
  Real reach = 1e9;
  Real start = 0;
  Real end = 1e30;
};
/// Frame in which the vectors of an AppliedForce are given.
enum class ForceAxes { world, body };
struct AppliedKey {
  Real time = 0;
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  /// Interpolation to the next key; default: the interpolation of the force.
  std::optional<sim::Interpolation> interpolation;
};
/// A force that acts at a point of each listed body, and a torque.
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

/// Returns the place in the file and the name of a force of any kind.
NamedForce& named(Force& force);
const NamedForce& named(const Force& force);

}  // namespace offstage::producer
