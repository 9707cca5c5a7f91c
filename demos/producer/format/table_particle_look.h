#pragma once
/// The key `look` of particles: how they are drawn.

#include <array>

#include "producer/format/table_shape.h"
#include "producer/format/values.h"

namespace offstage::producer {

inline constexpr Limits kTemperature = between(500, 15000);

template <>
struct Names<LookStyle> {
  static constexpr std::array kNames = {"sprite", "streak", "sphere", "smoke", "fire",
                                        "flake",  "drop",   "spark",  "mesh"};
};
template <>
struct Names<effects::RampKind> {
  static constexpr std::array kNames = {"linear", "smooth"};
};
template <>
struct Table<render::SpriteSheet> {
  static constexpr const char* kName = "sheet";
  static constexpr const char* kHelp =
      "Division of a sprite's texture into the pictures of a flip-book, in rows from the upper left corner.";
  static Fields<render::SpriteSheet> fields() {
    using T = render::SpriteSheet;
    return {
        {"columns", &T::columns, "number of pictures in a row", "", between(1, render::kMostSheetPictures)},
        {"rows", &T::rows, "number of rows", "", between(1, render::kMostSheetPictures)},
        {"fps", &T::fps, "pictures per second of a particle's age", "1/s", kNotNegative},
        {"blend", &T::blend, "whether each picture fades to the next; false: pictures change at once"},
        {"loop", &T::loop, "whether the first picture follows the last; false: the last picture stays"},
        {"random_start", &T::random_start, "whether particles start with different pictures"}};
  }
};
template <>
struct Table<LookMesh> {
  static constexpr const char* kName = "look_mesh";
  static constexpr const char* kHelp =
      "A shape or a model file that is drawn for each particle. It is scaled to fit into the particle's "
      "ball; its own size has no effect.";
  static Fields<LookMesh> fields() {
    using T = LookMesh;
    return {{"shape", &T::shape, "shape that is drawn; not a plane"},
            {"material", &T::material,
             "name of its material; empty: the material of the model file, or a default material"},
            {"axis", &T::axis,
             "axis of `angle_deg` and `spin_deg_per_s`, in the mesh's axes; default: a random axis for each "
             "particle",
             "", kDirection},
            {"along_motion", &T::along_motion, "whether the mesh's +Y axis points along the velocity"}};
  }
};
template <>
struct Table<ParticleLook> {
  static constexpr const char* kName = "look";
  static constexpr const char* kHelp =
      "How particles are drawn. The style gives the default of each key. `sprite`: soft disc; `streak`: lit "
      "line along the motion, with a shadow; `drop`: streak without a shadow; `sphere`: lit ball; `smoke`: "
      "puff that is shadowed by the smoke in front of it; `fire`: glowing flame; `flake`: snow or dust; "
      "`spark`: glowing point with a tail; `mesh`: small object.";
  static Fields<ParticleLook> fields() {
    using T = ParticleLook;
    return {
        {"style", &T::style, "kind of picture drawn for each particle"},
        {"color", &T::color, "base colour; alpha is the opacity"},
        {"color_over_age", &T::color_over_age,
         "colours that multiply `color`, each at an age: 0 is the birth time, 1 the end of the lifespan"},
        {"temperature_over_age", &T::temperature_over_age,
         "temperatures, each at an age in [0, 1]. The colour of the particle is multiplied by the colour of "
         "a black body of this temperature, and by the brightness of the black body relative to the hottest "
         "key",
         "K", kTemperature},
        {"size_over_age", &T::size_over_age,
         "factors of the drawn radius, each at an age in [0, 1]; the radius for collisions stays the same",
         "", kNotNegative},
        {"ramp", &T::ramp,
         "interpolation between the keys of `color_over_age`, `temperature_over_age` and `size_over_age`"},
        {"color_deviation", &T::color_deviation,
         "standard deviation of the brightness from particle to particle; 0: equal particles", "", kFraction},
        {"channel_deviation", &T::channel_deviation,
         "standard deviations of red, green, blue and opacity from particle to particle", "", kNotNegative},
        {"additive", &T::additive,
         "whether particles add light to the background instead of covering it; default: true for sparks and "
         "fire"},
        {"lit", &T::lit,
         "whether sun and sky light the particles; if false, their colour is emitted light; default: true "
         "except for sparks and fire"},
        {"casts_shadow", &T::casts_shadow,
         "whether the particles cast shadows; default: true for sprites, streaks, spheres and smoke"},
        {"softness", &T::softness, "width of the soft rim as a fraction of the radius; default: 0.5", "",
         kFraction},
        {"stretch", &T::stretch,
         "length of a streak, as the time in which the particle moves by this length; smoke, fire, flakes "
         "and sprites are lengthened by the same distance; default: 1/60, for sparks 1/40, for fire 0.1, for "
         "smoke and sprites 0",
         "s", kNotNegative},
        {"taper", &T::taper,
         "fraction by which a streak fades towards its tail; 1: the tail is invisible; default: 0, for "
         "sparks 1",
         "", kFraction},
        {"metallic", &T::metallic, "for spheres: 0 is a dielectric, 1 a metal; default: 0", "", kFraction},
        {"roughness", &T::roughness, "for spheres: 0 is a mirror, 1 is dull; default: 0.3", "", kFraction},
        {"texture", &T::texture,
         "image file that is drawn for each sprite, multiplied by the sprite's colour; empty: a soft disc. "
         "The longer side of the image is the particle's diameter"},
        {"sheet", &T::sheet,
         "division of the texture into the pictures of a flip-book; default: the texture is one picture"},
        {"mesh", &T::mesh, "the object that the style `mesh` draws, with its own material"},
        {"angle_deg", &T::angle_deg,
         "rotation of a new particle, counter-clockwise as seen by the camera, or about the axis of the "
         "mesh; for sprites with a texture, flakes and meshes",
         "degrees"},
        {"spin_deg_per_s", &T::spin_deg_per_s, "speed of the rotation that starts at `angle_deg`",
         "degrees/s"},
    };
  }
};

}  // namespace offstage::producer
