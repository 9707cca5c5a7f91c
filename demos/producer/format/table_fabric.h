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
        {"weave", &T::weave, "weave of the threads; `none`: a film, such as leather"},
        {"thread", &T::thread, "width of a thread", "m", kPositive},
        {"relief", &T::relief, "depth of the pattern of the threads", "", kFraction},
        {"sheen", &T::sheen, "light scattered by fibres, visible at grazing angles", "", kFraction},
        {"sheen_color", &T::sheen_color, "colour of the sheen"},
        {"translucency", &T::translucency, "fraction of the light that shines through", "", kFraction},
        {"back_color", &T::back_color, "colour of the back; default: the colour of the front"},
    };
  }
};

}  // namespace offstage::producer
