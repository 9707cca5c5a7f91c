#pragma once
/// The keys of the look of fabrics.

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
  static constexpr const char* kHelp = "Appearance of a cloth in addition to that of its material.";
  static Fields<FabricLook> fields() {
    using T = FabricLook;
    return {
        {"weave", &T::weave, "how the threads cross; `none`: a film, such as leather"},
        {"thread", &T::thread, "width of a thread", "m", kPositive},
        {"relief", &T::relief, "how far the threads stand out", "", kShare},
        {"sheen", &T::sheen, "light scattered by fibres, visible at grazing angles", "", kShare},
        {"sheen_color", &T::sheen_color, "colour of the sheen"},
        {"translucency", &T::translucency, "share of the light that shines through", "", kShare},
        {"back_color", &T::back_color, "colour of the back; default: that of the front"},
    };
  }
};

}  // namespace offstage::producer
