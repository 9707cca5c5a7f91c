#pragma once
/// The keys of an entry of `springs`.

#include "producer/format/values.h"

namespace offstage::producer {

template <>
struct Table<SpringEnd> {
  static constexpr const char* kName = "spring_end";
  static constexpr const char* kHelp = "A point of the world or of a body, or a particle of a group.";
  static Fields<SpringEnd> fields() {
    return {{"body", &SpringEnd::body, "name of a body; empty: none"},
            {"particles", &SpringEnd::particles, "name of a particle group; empty: none"},
            {"index", &SpringEnd::index, "index of the particle in its group", "", between(0, 1e9)},
            {"position", &SpringEnd::position,
             "position of the end in the frame of `body`, or in the world without a body", "m"}};
  }
};
template <>
struct Table<Spring> {
  static constexpr const char* kName = "spring";
  static constexpr const char* kHelp = "A damped spring between two points.";
  static Fields<Spring> fields() {
    using T = Spring;
    return {
        {"name", &T::name, "unique name; default: spring_N, where N is the index in the list"},
        {"a", &T::a, "first end of the spring"},
        {"b", &T::b, "second end of the spring"},
        {"stiffness", &T::stiffness, "stiffness of the spring: force per extension", "N/m", kNotNegative},
        {"damping", &T::damping, "damping of the spring: force per speed of extension", "N s/m",
         kNotNegative},
        {"rest_length", &T::rest_length,
         "length at which the spring exerts no force; negative: the distance of the ends at time 0, or when "
         "its "
         "particle appears",
         "m"},
        {"visible", &T::visible, "whether the spring is drawn as a rod"},
        {"radius", &T::radius, "radius of the rod", "m", kPositive},
        {"material", &T::material, "name of the rod's material; empty: grey"},
    };
  }
};

}  // namespace offstage::producer
