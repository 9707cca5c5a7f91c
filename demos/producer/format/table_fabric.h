#pragma once
/// The keys of `fabric` in an entry of `materials`: the appearance of cloth.

#include <array>

#include "producer/format/values.h"

namespace offstage::producer {

template <>
struct Names<render::Weave> {
  static constexpr std::array kNames = {"none", "plain", "twill", "satin"};
};
template <>
struct Table<FabricLook> {
  static constexpr const char* kName = "fabric_look";
  static constexpr const char* kHelp =
      "Appearance of a cloth, in addition to the appearance of its material.";
  static Fields<FabricLook> fields() {
    using T = FabricLook;
    return {
        {"weave", &T::weave, "weave of the threads; `none`: a surface without threads, such as leather"},
        {"thread", &T::thread, "width of a thread", "m", kPositive},
        {"relief", &T::relief, "depth of the shading between threads; 0: a flat surface", "", kFraction},
        {"sheen", &T::sheen, "strength of the light that fibres scatter, visible at grazing angles; 0: none",
         "", kFraction},
        {"sheen_color", &T::sheen_color, "colour of the light that fibres scatter (`sheen`)"},
        {"translucency", &T::translucency,
         "fraction of the light that shines through the cloth to its other side", "", kFraction},
        {"back_color", &T::back_color, "colour of the back; default: the colour of the front"},
    };
  }
};

}  // namespace offstage::producer
