#pragma once
/// The keys of forces on bodies: fields in a region, wind, a hand, explosions.

#include <array>

#include "producer/values.h"

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
  static constexpr const char* kHelp = "Where a field acts: on bodies with their centre of mass there.";
  static constexpr std::array kTags = {"everywhere", "sphere", "box"};
  static constexpr bool kRequired = false;
};

// --- Forces ---

inline constexpr Limits kDropRate = between(0, 16);

template <>
struct Table<FieldScope> {
  static Fields<FieldScope> fields() {
    using T = FieldScope;
    return {{"bodies", &T::bodies,
             "names of what it acts on, of one or of all copies; empty: all dynamic bodies"},
            {"region", &T::region, "where it acts"},
            {"drop_rate", &T::drop_rate,
             "power of its fall from the middle of the region to nothing at the edge; 0: the same throughout",
             "", kDropRate},
            {"start", &T::start, "from when", "s", kNotNegative},
            {"end", &T::end, "until when", "s", kNotNegative}};
  }
};
template <>
struct Table<ConstantField> {
  static constexpr const char* kName = "constant_field";
  static constexpr const char* kHelp = "The same force on every body, at its centre of mass.";
  static Fields<ConstantField> fields() {
    using T = ConstantField;
    return Fields<T>{{"name", &T::name, "unique; empty: force_ and its index"},
                     {"force", &T::force, "on each body", "N"}}
        .with_base<FieldScope>();
  }
};
template <>
struct Table<PointField> {
  static constexpr const char* kName = "point_field";
  static constexpr const char* kHelp = "A force towards a point, at the centre of mass.";
  static Fields<PointField> fields() {
    using T = PointField;
    return Fields<T>{{"name", &T::name, "unique; empty: force_ and its index"},
                     {"point", &T::point, "where it pulls to", "m"},
                     {"force", &T::force, "on each body; negative: away from the point", "N"}}
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
    return Fields<T>{{"name", &T::name, "unique; empty: force_ and its index"},
                     {"wind", &T::wind, "velocity of the air", "m/s"},
                     {"drag", &T::drag, "force per speed against the air", "kg/s", kNotNegative}}
        .with_base<FieldScope>();
  }
};
template <>
struct Table<HandKey> {
  static constexpr const char* kName = "hand_key";
  static constexpr const char* kHelp = "Where a hand is at a time.";
  static Fields<HandKey> fields() {
    return {{"time", &HandKey::time, "when; times must increase", "s"},
            {"position", &HandKey::position, "where", "m"}};
  }
};
template <>
struct Table<Grab> {
  static constexpr const char* kName = "grab";
  static constexpr const char* kHelp =
      "A hand that moves through keyframes and holds a point of a body by a damped spring of no length.";
  static Fields<Grab> fields() {
    using T = Grab;
    return {{"name", &T::name, "unique; empty: force_ and its index"},
            {"body", &T::body, "name of a dynamic body", kRequired},
            {"point", &T::point, "where it is held, in the body's frame", "m"},
            {"keyframes", &T::keyframes, "places of the hand, smooth in between; at least one"},
            {"stiffness", &T::stiffness, "force per distance", "N/m", kNotNegative},
            {"damping", &T::damping, "force per speed against the hand", "N s/m", kNotNegative},
            {"start", &T::start, "when it takes hold", "s", kNotNegative},
            {"end", &T::end, "when it lets go", "s", kNotNegative}};
  }
};
template <>
struct Table<Explosion> {
  static constexpr const char* kName = "explosion";
  static constexpr const char* kHelp =
      "A blow away from a point, at one time. It hits each body at its nearest point.";
  static Fields<Explosion> fields() {
    using T = Explosion;
    return {
        {"name", &T::name, "unique; empty: force_ and its index"},
        {"bodies", &T::bodies,
         "names of what it acts on, of one or of all copies; empty: all dynamic bodies"},
        {"time", &T::time, "when", "s", kNotNegative},
        {"point", &T::point, "where", "m"},
        {"impulse", &T::impulse, "on a body right at the point; negative: towards it", "N s"},
        {"radius", &T::radius, "no effect from this distance on", "m", kPositive},
        {"drop_rate", &T::drop_rate,
         "power of its fall from the point to nothing at the radius; 0: the same throughout", "", kDropRate}};
  }
};
template <>
struct Tags<Force> {
  static constexpr const char* kName = "force";
  static constexpr const char* kHelp =
      "Something that pushes or pulls dynamic bodies. Particles do not feel it.";
  static constexpr std::array kTags = {"constant", "point", "wind", "grab", "explosion"};
  static constexpr bool kRequired = true;
};

}  // namespace offstage::producer
