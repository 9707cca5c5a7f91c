#pragma once
/// The keys of forces: fields in a region, moving air, a hand, explosions, forces between particles.

#include <array>

#include "producer/format/values.h"

namespace offstage::producer {

// --- Regions ---

template <>
struct Table<sim::Everywhere> {
  static constexpr const char* kName = "everywhere";
  static constexpr const char* kHelp = "No limits.";
  static Fields<sim::Everywhere> fields() { return {}; }
};
template <>
struct Table<sim::SphereRegion> {
  static constexpr const char* kName = "sphere_region";
  static constexpr const char* kHelp = "A ball of the world.";
  static Fields<sim::SphereRegion> fields() {
    return {{"centre", &sim::SphereRegion::centre, "its middle", "m"},
            {"radius", &sim::SphereRegion::radius, "radius", "m", kPositive}};
  }
};
template <>
struct Table<sim::BoxRegion> {
  static constexpr const char* kName = "box_region";
  static constexpr const char* kHelp = "A cuboid along the axes of the world.";
  static Fields<sim::BoxRegion> fields() {
    return {{"centre", &sim::BoxRegion::centre, "its middle", "m"},
            {"size", &sim::BoxRegion::size, "full lengths of the edges", "m", kPositive}};
  }
};
template <>
struct Tags<sim::Region> {
  static constexpr const char* kName = "region";
  static constexpr const char* kHelp =
      "Where a field acts: on bodies with their centre of mass there, and on particles.";
  static constexpr std::array kTags = {"everywhere", "sphere", "box"};
  static constexpr bool kRequired = false;
};

// --- Forces ---

inline constexpr Limits kDropRate = between(0, 16);
inline constexpr const char* kDropRateHelp =
    "power of its fall from the middle of the region to nothing at the edge; 0: the same throughout";
inline constexpr const char* kParticlesHelp =
    "names of groups, of emitters, or of child particles, such as rain/splash";
inline constexpr const char* kClothsHelp =
    "names of cloths, of one or of all copies; moving air acts on their triangles, other forces as on the "
    "whole cloth, spread over it by mass";
inline constexpr const char* kBodiesHelp =
    "names of what it acts on, of one or of all copies; this and the next two empty: all dynamic bodies and "
    "all cloths";
inline constexpr const char* kForceNameHelp = "unique; empty: force_ and its index";
inline constexpr const char* kAirDragHelp =
    "force per speed against this air; 0: only through the drag that things have of their own";

template <>
struct Table<ForceScope> {
  static Fields<ForceScope> fields() {
    using T = ForceScope;
    return {{"bodies", &T::bodies, kBodiesHelp},
            {"particles", &T::particles, kParticlesHelp},
            {"cloths", &T::cloths, kClothsHelp},
            {"start", &T::start, "from when", "s", kNotNegative},
            {"end", &T::end, "until when", "s", kNotNegative}};
  }
};
template <>
struct Table<FieldScope> {
  static Fields<FieldScope> fields() {
    using T = FieldScope;
    return Fields<T>{{"region", &T::region, "where it acts"},
                     {"drop_rate", &T::drop_rate, kDropRateHelp, "", kDropRate}}
        .with_base<ForceScope>();
  }
};
template <>
struct Table<PairScope> {
  static Fields<PairScope> fields() {
    using T = PairScope;
    return {{"particles", &T::particles, "names of groups and emitters whose particles act on each other",
             kRequired},
            {"cut_off", &T::cut_off, "no force from this distance on, which saves much time; 0: none", "m",
             kNotNegative},
            {"region", &T::region, "where it acts"},
            {"drop_rate", &T::drop_rate, kDropRateHelp, "", kDropRate},
            {"start", &T::start, "from when", "s", kNotNegative},
            {"end", &T::end, "until when", "s", kNotNegative}};
  }
};
template <>
struct Table<ConstantField> {
  static constexpr const char* kName = "constant_field";
  static constexpr const char* kHelp =
      "The same force on every body, at its centre of mass, and on every particle.";
  static Fields<ConstantField> fields() {
    using T = ConstantField;
    return Fields<T>{{"name", &T::name, kForceNameHelp},
                     {"force", &T::force, "on each body and particle", "N"}}
        .with_base<FieldScope>();
  }
};
template <>
struct Table<PointField> {
  static constexpr const char* kName = "point_field";
  static constexpr const char* kHelp = "A force towards a point, at the centre of mass.";
  static Fields<PointField> fields() {
    using T = PointField;
    return Fields<T>{{"name", &T::name, kForceNameHelp},
                     {"point", &T::point, "where it pulls to", "m"},
                     {"force", &T::force, "on each; negative: away from the point", "N"}}
        .with_base<FieldScope>();
  }
};
template <>
struct Table<WindField> {
  static constexpr const char* kName = "wind";
  static constexpr const char* kHelp =
      "Moving air: a drag towards its own velocity, besides that of the bodies themselves.";
  static Fields<WindField> fields() {
    using T = WindField;
    return Fields<T>{{"name", &T::name, kForceNameHelp},
                     {"wind", &T::wind, "velocity of the air", "m/s"},
                     {"drag", &T::drag, kAirDragHelp, "kg/s", kNotNegative}}
        .with_base<FieldScope>();
  }
};
template <>
struct Table<HandKey> {
  static constexpr const char* kName = "hand_key";
  static constexpr const char* kHelp = "Where a hand is at a time.";
  static Fields<HandKey> fields() {
    return {{"time", &HandKey::time, "when; times must increase", "s"},
            {"position", &HandKey::position, "where", "m"},
            {"interpolation", &HandKey::interpolation, "from this key to the next; left out: the grab's"}};
  }
};
template <>
struct Table<Grab> {
  static constexpr const char* kName = "grab";
  static constexpr const char* kHelp =
      "A hand that moves through keyframes and holds a point of a body, or particles, or points of cloths, "
      "by "
      "damped springs of no length.";
  static Fields<Grab> fields() {
    using T = Grab;
    return {{"name", &T::name, kForceNameHelp},
            {"body", &T::body, "name of a dynamic body; empty: none"},
            {"particles", &T::particles, kParticlesHelp},
            {"cloths", &T::cloths, "names of cloths"},
            {"point", &T::point, "where it is held, in the body's frame", "m"},
            {"keyframes", &T::keyframes, "places of the hand; at least one"},
            {"interpolation", &T::interpolation, kInterpolationHelp},
            {"stiffness", &T::stiffness, "force per distance", "N/m", kNotNegative},
            {"damping", &T::damping, "force per speed against the hand", "N s/m", kNotNegative},
            {"reach", &T::reach, "particles and points of cloths farther away than this are left alone", "m",
             kPositive},
            {"start", &T::start, "when it takes hold", "s", kNotNegative},
            {"end", &T::end, "when it lets go", "s", kNotNegative}};
  }
};
template <>
struct Table<Explosion> {
  static constexpr const char* kName = "explosion";
  static constexpr const char* kHelp =
      "An impulse away from a point, at one time. It hits each body at its nearest point.";
  static Fields<Explosion> fields() {
    using T = Explosion;
    return {
        {"name", &T::name, kForceNameHelp},
        {"bodies", &T::bodies, kBodiesHelp},
        {"particles", &T::particles, kParticlesHelp},
        {"cloths", &T::cloths, kClothsHelp},
        {"time", &T::time, "when", "s", kNotNegative},
        {"point", &T::point, "where", "m"},
        {"impulse", &T::impulse, "on what is right at the point; negative: towards it", "N s"},
        {"radius", &T::radius, "no effect from this distance on", "m", kPositive},
        {"drop_rate", &T::drop_rate,
         "power of its fall from the point to nothing at the radius; 0: the same throughout", "", kDropRate}};
  }
};
template <>
struct Table<VortexField> {
  static constexpr const char* kName = "vortex";
  static constexpr const char* kHelp =
      "Air that turns about an axis: with the distance r from it at the speed circulation r / (2 pi (r^2 + "
      "radius^2)).";
  static Fields<VortexField> fields() {
    using T = VortexField;
    return Fields<T>{{"name", &T::name, kForceNameHelp},
                     {"point", &T::point, "of the axis", "m"},
                     {"axis", &T::axis, "its direction; right-handed", "", kDirection},
                     {"circulation", &T::circulation, "how strong it is; negative: the other way", "m^2/s"},
                     {"radius", &T::radius, "where the air is fastest", "m", kPositive},
                     {"drag", &T::drag, kAirDragHelp, "kg/s", kNotNegative}}
        .with_base<FieldScope>();
  }
};
template <>
struct Table<TurbulenceField> {
  static constexpr const char* kName = "turbulence";
  static constexpr const char* kHelp = "Air that swirls in eddies of several sizes, without divergence.";
  static Fields<TurbulenceField> fields() {
    using T = TurbulenceField;
    return Fields<T>{
        {"name", &T::name, kForceNameHelp},
        {"speed", &T::speed, "root mean square of the air's speed", "m/s", kNotNegative},
        {"scale", &T::scale, "width of the largest eddies", "m", kPositive},
        {"octaves", &T::octaves, "sizes of eddies, each half of the one before", "", between(1, 8)},
        {"lifetime", &T::lifetime, "of the largest eddies; 0: they turn over once, scale / speed", "s",
         kNotNegative},
        {"drift", &T::drift, "of the eddies, with the wind", "m/s"},
        {"seed", &T::seed, "another number, other eddies", "", between(0, 1e9)},
        {"drag", &T::drag, kAirDragHelp, "kg/s", kNotNegative}}
        .with_base<FieldScope>();
  }
};
template <>
struct Table<GravitationForce> {
  static constexpr const char* kName = "gravitation";
  static constexpr const char* kHelp = "Particles that attract each other by their masses.";
  static Fields<GravitationForce> fields() {
    using T = GravitationForce;
    return Fields<T>{
        {"name", &T::name, kForceNameHelp},
        {"constant", &T::constant, "of gravitation", "N m^2/kg^2", kNotNegative},
        {"softening", &T::softening, "as if masses were spread over this radius", "m", kNotNegative}}
        .with_base<PairScope>();
  }
};
template <>
struct Table<CoulombForce> {
  static constexpr const char* kName = "coulomb";
  static constexpr const char* kHelp = "Particles that attract and repel each other by their charges.";
  static Fields<CoulombForce> fields() {
    using T = CoulombForce;
    return Fields<T>{
        {"name", &T::name, kForceNameHelp},
        {"constant", &T::constant, "of electrostatics", "N m^2/C^2", kNotNegative},
        {"softening", &T::softening, "as if charges were spread over this radius", "m", kNotNegative}}
        .with_base<PairScope>();
  }
};
template <>
struct Table<LennardJonesForce> {
  static constexpr const char* kName = "lennard_jones";
  static constexpr const char* kHelp =
      "Particles that keep a distance, as atoms do: they repel closer than 1.12 sigma, attract beyond.";
  static Fields<LennardJonesForce> fields() {
    using T = LennardJonesForce;
    return Fields<T>{{"name", &T::name, kForceNameHelp},
                     {"epsilon", &T::epsilon, "depth of the well", "J", kNotNegative},
                     {"sigma", &T::sigma, "where the energy is that of particles far apart", "m", kPositive}}
        .with_base<PairScope>();
  }
};
template <>
struct Tags<Force> {
  static constexpr const char* kName = "force";
  static constexpr const char* kHelp = "Something that pushes or pulls bodies, cloths and particles.";
  static constexpr std::array kTags = {"constant", "point",      "wind",        "grab",    "explosion",
                                       "vortex",   "turbulence", "gravitation", "coulomb", "lennard_jones"};
  static constexpr bool kRequired = true;
};

}  // namespace offstage::producer
