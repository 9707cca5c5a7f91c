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
  static constexpr const char* kHelp = "What the look of a cloth has besides its material's.";
  static Fields<FabricLook> fields() {
    using T = FabricLook;
    return {
        {"weave", &T::weave, "how the threads cross; none: a film, such as leather"},
        {"thread", &T::thread, "width of a thread, along the cloth", "m", kPositive},
        {"relief", &T::relief, "how strongly threads stand out", "", kShare},
        {"sheen", &T::sheen, "light from fibres that stand off, seen where it grazes", "", kShare},
        {"sheen_color", &T::sheen_color, "its colour"},
        {"translucency", &T::translucency, "share of the light that shines through", "", kShare},
        {"back_color", &T::back_color, "colour of the back; left out: the front's"},
    };
  }
};

}  // namespace offstage::producer
