#pragma once
/// The keys of an entry of `materials`, and of `contacts`, the rules for pairs of materials.

#include <array>

#include "producer/format/table_fabric.h"
#include "producer/format/values.h"

namespace offstage::producer {

template <>
struct Names<render::Pattern> {
  static constexpr std::array kNames = {"none",     "checker", "grid",   "noise",   "brick",
                                        "wood",     "lawn",    "paving", "stripes", "gingham",
                                        "concrete", "sand",    "planks", "water"};
};

template <>
struct Names<TextureProjection> {
  static constexpr std::array kNames = {"surface", "triplanar"};
};

template <>
struct Table<Material> {
  static constexpr const char* kName = "material";
  static constexpr const char* kHelp = "Appearance and contact behaviour of a surface.";
  static Fields<Material> fields() {
    using T = Material;
    return {
        {"name", &T::name,
         "name by which bodies, springs and cloths refer to the material; default: material_N, where N is "
         "the index in the list"},
        {"color", &T::color, "base colour; with an alpha below 1 the surface and its shadow are translucent"},
        {"metallic", &T::metallic, "0: dielectric, such as plastic or wood; 1: metal", "", kFraction},
        {"roughness", &T::roughness, "roughness of the surface; 0: mirror, 1: dull", "", kFraction},
        {"transmission", &T::transmission,
         "fraction of the light that passes through the surface: 1 is glass, which tints the light with its "
         "colour; for cloth, the fraction that passes between the threads without a tint",
         "", kFraction},
        {"refraction", &T::refraction,
         "index of refraction of a material with a `transmission`; water has 1.33, glass about 1.5", "",
         between(1, 3)},
        {"emission", &T::emission, "colour of the emitted light"},
        {"emission_strength", &T::emission_strength,
         "factor of the emission; 1 is as bright as a white surface in sunlight", "", kBrightness},
        {"pattern", &T::pattern, "pattern in a second colour over the base colour"},
        {"pattern_color", &T::pattern_color, "second colour, used by the pattern"},
        {"pattern_scale", &T::pattern_scale, "size of one cell of the pattern", "m", kPositive},
        {"texture", &T::texture, "image file that multiplies the base colour; empty: none"},
        {"texture_projection", &T::texture_projection,
         "`surface` maps the texture by the texture coordinates of the shape or model: one copy covers each "
         "side of a primitive, or a whole cloth. `triplanar` projects it along the three axes of the body, "
         "without distortion or seams. Triplanar is not for cloths"},
        {"texture_scale", &T::texture_scale,
         "size of one copy of the texture. With `triplanar` this is its width in metres. With `surface` it "
         "is a factor: 1 covers the side of a primitive with one copy, 0.5 with 2 x 2 copies",
         "", kScale},
        {"texture_angle_deg", &T::texture_angle_deg,
         "angle by which the texture is turned counter-clockwise: about its centre or, with `triplanar`, "
         "about the axes of the body",
         "degrees"},
        {"two_sided", &T::two_sided,
         "whether back faces are lit and drawn as well, also in mirrors; shadows do not depend on it"},
        {"fabric", &T::fabric,
         "appearance of the threads, if the material is used for a cloth; default: the appearance of the "
         "cloth's fabric"},
        {"restitution", &T::restitution,
         "coefficient of restitution: speed of separation / speed of approach; 0: no bounce. A contact uses "
         "the larger value of its two materials",
         "", kFraction},
        {"friction", &T::friction,
         "coefficient of dynamic friction; a contact uses the geometric mean of the values of its two "
         "materials, also for `static_friction` and `cross_friction`",
         "", kNotNegative},
        {"static_friction", &T::static_friction,
         "coefficient of static friction between bodies; default: the same as `friction`", "", kNotNegative},
        {"cross_friction", &T::cross_friction,
         "coefficient of dynamic friction across the `friction_axis` of a body; needs a `friction` above 0; "
         "default: the same as `friction`",
         "", kNotNegative},
        {"rolling_friction", &T::rolling_friction,
         "greatest torque against rolling between bodies, per contact force. This is the distance by which "
         "the centre of pressure is ahead of the middle of the contact. A ball of radius r decelerates by "
         "5/7 g `rolling_friction` / r. Steel on steel has about 1e-5 m, a ball on carpet 1e-3 m; a contact "
         "uses the larger value of its two materials",
         "m", kNotNegative},
        {"spinning_friction", &T::spinning_friction,
         "greatest torque against spinning about the contact's normal between bodies, per contact force: "
         "about 0.6 times `friction` times the radius of the contact area. It shares its limit with sliding "
         "friction; a contact uses the larger value of its two materials",
         "m", kNotNegative},
    };
  }
};
template <>
struct Table<ContactRule> {
  static constexpr const char* kName = "contact";
  static constexpr const char* kHelp =
      "Contact behaviour of two materials, used instead of the values that follow from each material.";
  static Fields<ContactRule> fields() {
    using T = ContactRule;
    return {
        {"materials", &T::materials, "names of two materials, in any order; may be the same", kRequired},
        {"restitution", &T::restitution,
         "coefficient of restitution; default: the value that follows from the two materials", "", kFraction},
        {"friction", &T::friction,
         "coefficient of dynamic friction, along the friction axis if there is one; across it, the ratio "
         "given by the materials applies; default: the value that follows from the two materials",
         "", kNotNegative},
        {"static_friction", &T::static_friction,
         "coefficient of static friction; default: the `friction` of this rule if given, otherwise the value "
         "that follows from the two materials",
         "", kNotNegative},
        {"rolling_friction", &T::rolling_friction,
         "coefficient of rolling friction; default: the value that follows from the two materials", "m",
         kNotNegative},
        {"spinning_friction", &T::spinning_friction,
         "coefficient of spinning friction; default: the value that follows from the two materials", "m",
         kNotNegative},
    };
  }
};

}  // namespace offstage::producer
