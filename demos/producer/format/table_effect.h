#pragma once
/// The keys of an entry of `effects`. Each entry names a preset.

#include "producer/format/values.h"
#include "producer/scene/effects.h"

namespace offstage::producer {

template <>
struct Codec<Overrides> {
  static void read(Reader& in, const Node& node, const Spec&, Overrides& out) {
    const Object* object = node.as<Object>();
    if (!object) return in.refuse(node, "an object");
    for (const Member& member : *object)
      in.within(member.key, [&] {
        if (!member.value.as<Object>()) in.refuse(member.value, "an object");
      });
    out.node = node;
  }
  static Node write(const Overrides& value) { return value.node; }
  static Description describe(Catalogue&, const Spec&) {
    return {{{"type", "object"}, {"additionalProperties", Object{{"type", "object"}}}}, "object"};
  }
};
template <>
struct Table<Effect> {
  static constexpr const char* kName = "effect";
  static constexpr const char* kHelp =
      "All emitters and forces of a preset, with some of their keys replaced. `offstage presets` lists the "
      "presets.";
  static Fields<Effect> fields() {
    using T = Effect;
    return {{"preset", &T::preset, "name of the preset", kRequired},
            {"name", &T::name,
             "prefix of the names of the effect's emitters and forces, followed by a slash; empty: the "
             "preset's name"},
            {"position", &T::position, "position of the preset's origin, in the world or in the body's frame",
             "m"},
            {"body", &T::body, "name of the body with which the effect's emitters move; empty: none"},
            {"start", &T::start, "time added to all times of the preset", "s", kNotNegative},
            {"overrides", &T::overrides,
             "keys to replace: an object for each emitter or force, under its name in the preset"}};
  }
};

}  // namespace offstage::producer
