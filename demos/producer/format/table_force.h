#pragma once
/// The keys of forces: fields in a region, moving air, grabs, explosions, forces between particles.

#include <array>

#include "producer/format/values.h"

namespace offstage::producer {

// --- Regions ---

template <>
struct Table<sim::Everywhere> {
  static constexpr const char* kName = "everywhere";
  static constexpr const char* kHelp = "The whole world.";
  static Fields<sim::Everywhere> fields() { return {}; }
};
template <>
struct Table<sim::SphereRegion> {
  static constexpr const char* kName = "sphere_region";
  static constexpr const char* kHelp = "A ball in the world.";
  static Fields<sim::SphereRegion> fields() {
    return {{"centre", &sim::SphereRegion::centre, "centre of the ball", "m"},
            {"radius", &sim::SphereRegion::radius, "radius of the ball", "m", kPositive}};
  }
};
template <>
struct Table<sim::BoxRegion> {
  static constexpr const char* kName = "box_region";
  static constexpr const char* kHelp = "A cuboid along the axes of the world.";
  static Fields<sim::BoxRegion> fields() {
    return {{"centre", &sim::BoxRegion::centre, "centre of the cuboid", "m"},
            {"size", &sim::BoxRegion::size, "full lengths of the edges", "m", kPositive}};
  }
};
template <>
struct Tags<sim::Region> {
  static constexpr const char* kName = "region";
  static constexpr const char* kHelp =
      "The region in which a field acts: on particles inside, and on bodies whose centre of mass is inside.";
  static constexpr std::array kTags = {"everywhere", "sphere", "box"};
  static constexpr bool kRequired = false;
};

// --- Forces ---

inline constexpr Limits kDropRate = between(0, 16);
inline constexpr const char* kDropRateHelp =
    "exponent of the decrease of the force from the centre of the region to zero at its edge; 0: uniform; a "
    "larger exponent concentrates the force at the centre";
inline constexpr const char* kParticlesHelp =
    "names of particle groups, emitters, or child particles, such as rain/splash";
inline constexpr const char* kClothsHelp =
    "names of cloths; a name without the number of a copy means all copies. Moving air acts on each "
    "triangle, other forces act on the whole cloth, distributed by mass";
inline constexpr const char* kBodiesHelp =
    "names of the bodies on which the force acts; a name without the number of a copy means all copies. If "
    "`bodies`, `particles` and `cloths` are all empty, the force acts on all dynamic bodies and all cloths";
inline constexpr const char* kForceNameHelp =
    "unique name; default: force_N, where N is the index in the list";
inline constexpr const char* kAirDragHelp =
    "drag force on an object per speed relative to this air; 0: the air acts only through the drag of each "
    "object";

template <>
struct Table<ForceScope> {
  static Fields<ForceScope> fields() {
    using T = ForceScope;
    return {{"bodies", &T::bodies, kBodiesHelp},
            {"particles", &T::particles, kParticlesHelp},
            {"cloths", &T::cloths, kClothsHelp},
            {"start", &T::start, "time at which the force starts", "s", kNotNegative},
            {"end", &T::end, "time at which the force ends", "s", kNotNegative}};
  }
};
/// Appends the keys that all fields have.
template <class T>
Fields<T> field_keys(Fields<T> own) {
  return std::move(own)
      .then({{"region", &T::region, "region in which the force acts"},
             {"drop_rate", &T::drop_rate, kDropRateHelp, "", kDropRate}})
      .template with_base<ForceScope>();
}
/// Appends the keys that all forces between particles have.
template <class T>
Fields<T> pair_keys(Fields<T> own) {
  return std::move(own).then(
      {{"particles", &T::particles, "names of particle groups and emitters whose particles act on each other",
        kRequired},
       {"cut_off", &T::cut_off,
        "particles at a greater distance do not act on each other, which saves much time; 0: no limit", "m",
        kNotNegative},
       {"region", &T::region, "region in which the force acts"},
       {"drop_rate", &T::drop_rate, kDropRateHelp, "", kDropRate},
       {"start", &T::start, "time at which the force starts", "s", kNotNegative},
       {"end", &T::end, "time at which the force ends", "s", kNotNegative}});
}
template <>
struct Table<ConstantField> {
  static constexpr const char* kName = "constant_field";
  static constexpr const char* kHelp =
      "The same force on every body, at its centre of mass, and on every particle.";
  static Fields<ConstantField> fields() {
    using T = ConstantField;
    return field_keys(Fields<T>{{"name", &T::name, kForceNameHelp},
                                {"force", &T::force, "force on each body and particle", "N"}});
  }
};
template <>
struct Table<PointField> {
  static constexpr const char* kName = "point_field";
  static constexpr const char* kHelp = "A force towards a point. On bodies it acts at the centre of mass.";
  static Fields<PointField> fields() {
    using T = PointField;
    return field_keys(Fields<T>{
        {"name", &T::name, kForceNameHelp},
        {"point", &T::point, "point of attraction", "m"},
        {"force", &T::force, "force on each body and particle; negative: away from the point", "N"}});
  }
};
template <>
struct Table<WindField> {
  static constexpr const char* kName = "wind";
  static constexpr const char* kHelp =
      "Moving air: a drag force towards its velocity, in addition to the drag that bodies have.";
  static Fields<WindField> fields() {
    using T = WindField;
    return field_keys(Fields<T>{{"name", &T::name, kForceNameHelp},
                                {"wind", &T::wind, "velocity of the air", "m/s"},
                                {"drag", &T::drag, kAirDragHelp, "kg/s", kNotNegative}});
  }
};
template <>
struct Table<HandKey> {
  static constexpr const char* kName = "hand_key";
  static constexpr const char* kHelp = "Position of a hand at a time.";
  static Fields<HandKey> fields() {
    return {{"time", &HandKey::time, "time of the key; times must increase", "s"},
            {"position", &HandKey::position, "position of the hand", "m"},
            {"interpolation", &HandKey::interpolation,
             "interpolation from this key to the next; default: the interpolation of the grab"}};
  }
};
template <>
struct Table<Grab> {
  static constexpr const char* kName = "grab";
  static constexpr const char* kHelp =
      "A hand that moves through keyframes and holds a point of a body, or particles, or points of cloths, "
      "by damped springs of rest length 0.";
  static Fields<Grab> fields() {
    using T = Grab;
    return {{"name", &T::name, kForceNameHelp},
            {"body", &T::body, "name of a dynamic body; empty: none"},
            {"particles", &T::particles, kParticlesHelp},
            {"cloths", &T::cloths, "names of cloths whose points the hand can hold"},
            {"point", &T::point, "point of the body that is held, in the body's frame", "m"},
            {"keyframes", &T::keyframes, "positions of the hand; at least one"},
            {"interpolation", &T::interpolation, kInterpolationHelp},
            {"stiffness", &T::stiffness, "stiffness of the springs: force per distance from the hand", "N/m",
             kNotNegative},
            {"damping", &T::damping, "damping of the springs: force per speed relative to the hand", "N s/m",
             kNotNegative},
            {"reach", &T::reach,
             "particles and cloth points at a greater distance from the hand are not held; the held points "
             "of a cloth share the spring",
             "m", kPositive},
            {"start", &T::start, "time at which the hand grabs", "s", kNotNegative},
            {"end", &T::end, "time at which the hand releases", "s", kNotNegative}};
  }
};
template <>
struct Names<ForceAxes> {
  static constexpr std::array kNames = {"world", "body"};
};
template <>
struct Table<AppliedKey> {
  static constexpr const char* kName = "applied_key";
  static constexpr const char* kHelp = "Force and torque at a time.";
  static Fields<AppliedKey> fields() {
    using T = AppliedKey;
    return {{"time", &T::time, "time of the key; times must increase", "s"},
            {"force", &T::force, "force at this time", "N"},
            {"torque", &T::torque, "torque at this time", "N m"},
            {"interpolation", &T::interpolation,
             "interpolation from this key to the next; default: the interpolation of the force"}};
  }
};
template <>
struct Table<AppliedForce> {
  static constexpr const char* kName = "applied_force";
  static constexpr const char* kHelp =
      "A force at a point of each named body, and a torque: a thruster, a motor, a push. Both are constant "
      "or follow keyframes.";
  static Fields<AppliedForce> fields() {
    using T = AppliedForce;
    return {
        {"name", &T::name, kForceNameHelp},
        {"bodies", &T::bodies,
         "names of the dynamic bodies on which the force acts; a name without the number of a copy means all "
         "copies",
         kRequired},
        {"point", &T::point, "point of application in the body's frame; default: the centre of mass", "m"},
        {"axes", &T::axes,
         "axes of `force` and `torque`: `world` axes are fixed, `body` axes turn with the body"},
        {"force", &T::force, "constant force on each body; not with `keyframes`", "N"},
        {"torque", &T::torque,
         "constant torque on each body, in addition to the torque that `force` exerts about the centre of "
         "mass; not with `keyframes`",
         "N m"},
        {"keyframes", &T::keyframes,
         "force and torque over time, instead of `force` and `torque`; constant before the first key and "
         "after the last key"},
        {"interpolation", &T::interpolation, kInterpolationHelp},
        {"start", &T::start, "time at which the force starts", "s", kNotNegative},
        {"end", &T::end, "time at which the force ends", "s", kNotNegative}};
  }
};
template <>
struct Table<Explosion> {
  static constexpr const char* kName = "explosion";
  static constexpr const char* kHelp =
      "An impulse away from a point at one time. It acts on each body at the body's nearest point.";
  static Fields<Explosion> fields() {
    using T = Explosion;
    return {
        {"name", &T::name, kForceNameHelp},
        {"bodies", &T::bodies, kBodiesHelp},
        {"particles", &T::particles, kParticlesHelp},
        {"cloths", &T::cloths, kClothsHelp},
        {"time", &T::time, "time of the explosion", "s", kNotNegative},
        {"point", &T::point, "centre of the explosion", "m"},
        {"impulse", &T::impulse, "impulse on an object at the centre; negative: towards the centre", "N s"},
        {"radius", &T::radius, "distance from the centre at which the effect ends", "m", kPositive},
        {"drop_rate", &T::drop_rate,
         "exponent of the decrease of the impulse from the centre to zero at the radius; 0: uniform; a "
         "larger exponent concentrates the impulse at the centre",
         "", kDropRate}};
  }
};
template <>
struct Table<VortexField> {
  static constexpr const char* kName = "vortex";
  static constexpr const char* kHelp =
      "Air that rotates about an axis. At the distance r from the axis, the speed of the air is circulation "
      "r / (2 pi (r^2 + radius^2)).";
  static Fields<VortexField> fields() {
    using T = VortexField;
    return field_keys(Fields<T>{
        {"name", &T::name, kForceNameHelp},
        {"point", &T::point, "a point on the axis, in the world", "m"},
        {"axis", &T::axis, "direction of the axis; the air turns by the right-hand rule", "", kDirection},
        {"circulation", &T::circulation, "strength of the vortex; negative: the air turns the other way",
         "m^2/s"},
        {"radius", &T::radius, "distance from the axis at which the air is fastest", "m", kPositive},
        {"drag", &T::drag, kAirDragHelp, "kg/s", kNotNegative}});
  }
};
template <>
struct Table<TurbulenceField> {
  static constexpr const char* kName = "turbulence";
  static constexpr const char* kHelp = "Divergence-free turbulent air with eddies of several sizes.";
  static Fields<TurbulenceField> fields() {
    using T = TurbulenceField;
    return field_keys(Fields<T>{
        {"name", &T::name, kForceNameHelp},
        {"speed", &T::speed, "root mean square of the air's speed", "m/s", kNotNegative},
        {"scale", &T::scale, "width of the largest eddies", "m", kPositive},
        {"octaves", &T::octaves, "number of eddy sizes, each half of the previous one", "", between(1, 8)},
        {"lifetime", &T::lifetime, "lifetime of the largest eddies; 0: their turnover time, scale / speed",
         "s", kNotNegative},
        {"drift", &T::drift, "velocity at which the eddies move; this force adds no mean wind", "m/s"},
        {"seed", &T::seed, "seed of the random numbers that place the eddies", "", between(0, 1e9)},
        {"drag", &T::drag, kAirDragHelp, "kg/s", kNotNegative}});
  }
};
template <>
struct Table<GravitationForce> {
  static constexpr const char* kName = "gravitation";
  static constexpr const char* kHelp = "Gravitation between particles.";
  static Fields<GravitationForce> fields() {
    using T = GravitationForce;
    return pair_keys(
        Fields<T>{{"name", &T::name, kForceNameHelp},
                  {"constant", &T::constant, "gravitational constant", "N m^2/kg^2", kNotNegative},
                  {"softening", &T::softening,
                   "radius over which each mass is spread, so that forces stay finite", "m", kNotNegative}});
  }
};
template <>
struct Table<CoulombForce> {
  static constexpr const char* kName = "coulomb";
  static constexpr const char* kHelp = "Electrostatic force between charged particles.";
  static Fields<CoulombForce> fields() {
    using T = CoulombForce;
    return pair_keys(Fields<T>{
        {"name", &T::name, kForceNameHelp},
        {"constant", &T::constant, "Coulomb constant", "N m^2/C^2", kNotNegative},
        {"softening", &T::softening, "radius over which each charge is spread, so that forces stay finite",
         "m", kNotNegative}});
  }
};
template <>
struct Table<LennardJonesForce> {
  static constexpr const char* kName = "lennard_jones";
  static constexpr const char* kHelp =
      "The force between atoms: particles closer than 1.12 sigma repel each other, others attract each "
      "other.";
  static Fields<LennardJonesForce> fields() {
    using T = LennardJonesForce;
    return pair_keys(
        Fields<T>{{"name", &T::name, kForceNameHelp},
                  {"epsilon", &T::epsilon, "depth of the potential well", "J", kNotNegative},
                  {"sigma", &T::sigma, "distance at which the potential energy is zero", "m", kPositive}});
  }
};
template <>
struct Tags<Force> {
  static constexpr const char* kName = "force";
  static constexpr const char* kHelp = "A force on bodies, cloths and particles.";
  static constexpr std::array kTags = {"constant",  "point",         "wind",       "grab",
                                       "explosion", "vortex",        "turbulence", "gravitation",
                                       "coulomb",   "lennard_jones", "applied"};
  static constexpr bool kRequired = true;
};

}  // namespace offstage::producer
