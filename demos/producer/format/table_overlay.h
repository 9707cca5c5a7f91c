#pragma once
/// The keys of overlays: lines and text over the picture that show the state of the simulation.

#include <array>

#include "producer/format/values.h"

namespace offstage::producer {

template <>
struct Table<LineLook> {
  static Fields<LineLook> fields() {
    return {{"width", &LineLook::width, "width of the lines, as a fraction of the picture's height", "",
             over(0, 0.1)},
            {"hidden", &LineLook::hidden, "opacity of lines that are behind an object; 0: hidden", "",
             kFraction}};
  }
};

template <>
struct Names<BoundingVolumeKind> {
  static constexpr std::array kNames = {"aabb", "obb", "sphere"};
};
template <>
struct Table<TreeOverlay> {
  static constexpr const char* kName = "tree_overlay";
  static constexpr const char* kHelp =
      "The bounding tree of a body with a mesh: the volumes of one level, and the leaves of the levels above "
      "it.";
  static Fields<TreeOverlay> fields() {
    using T = TreeOverlay;
    return Fields<T>{
        {"body", &T::body, "name of a body with a mesh", kRequired},
        {"volume", &T::volume,
         "bounding volumes: boxes along the body's axes (`aabb`), oriented boxes (`obb`), or balls "
         "(`sphere`)"},
        {"level", &T::level,
         "level that is drawn; 0: the root; fractions fade between two levels; a number or a curve over time",
         "", between(0, 16)}}
        .with_base<LineLook>();
  }
};
template <>
struct Table<PartsOverlay> {
  static constexpr const char* kName = "parts_overlay";
  static constexpr const char* kHelp =
      "The convex parts of a body with a mesh, each in its own colour, drawn instead of the body.";
  static Fields<PartsOverlay> fields() {
    using T = PartsOverlay;
    return {{"body", &T::body, "name of a body with a mesh", kRequired},
            {"explode", &T::explode,
             "outward displacement of each part, as a fraction of its distance from the centre; a number or "
             "a curve over time",
             "", between(0, 100)}};
  }
};
template <>
struct Table<ClosestOverlay> {
  static constexpr const char* kName = "closest_overlay";
  static constexpr const char* kHelp =
      "The closest points of two bodies, or the shortest translation that separates them where they overlap.";
  static Fields<ClosestOverlay> fields() {
    using T = ClosestOverlay;
    return Fields<T>{{"a", &T::a, "name of a body", kRequired},
                     {"b", &T::b, "name of another body", kRequired},
                     {"color", &T::color, "colour while the bodies are apart"},
                     {"penetrating", &T::penetrating, "colour while the bodies overlap"}}
        .with_base<LineLook>();
  }
};
template <>
struct Table<ContactsOverlay> {
  static constexpr const char* kName = "contacts_overlay";
  static constexpr const char* kHelp =
      "Contact points of bodies as rings, with arrows in the direction of the force on the first body (for a "
      "plane: on the other body). The points come from the simulation, or from the geometry if neither body "
      "is dynamic.";
  static Fields<ContactsOverlay> fields() {
    using T = ContactsOverlay;
    return Fields<T>{
        {"a", &T::a, "name of a body; empty: every pair of bodies that collide"},
        {"b", &T::b, "name of another body; empty: every pair of bodies that collide"},
        {"margin", &T::margin, "two bodies that are not dynamic are in contact if they are closer than this",
         "m", kNotNegative},
        {"size", &T::size, "radius of the rings; the length of arrows is four times this", "m", kPositive},
        {"force_scale", &T::force_scale,
         "length of the arrows per contact force, including friction; 0: all arrows have the same length and "
         "show only the normal",
         "m/N", kNotNegative},
        {"color", &T::color, "colour of rings and arrows"}}
        .with_base<LineLook>();
  }
};
template <>
struct Table<VelocitiesOverlay> {
  static constexpr const char* kName = "velocities_overlay";
  static constexpr const char* kHelp = "Velocities of bodies, as arrows from their centres of mass.";
  static Fields<VelocitiesOverlay> fields() {
    using T = VelocitiesOverlay;
    return Fields<T>{{"body", &T::body, "name of a body; empty: all bodies that are not static"},
                     {"scale", &T::scale, "length of the arrows per speed", "s", kNotNegative},
                     {"angular_scale", &T::angular_scale,
                      "length of the arrows along the axis of rotation, per angular speed; 0: no such arrows",
                      "m s/rad", kNotNegative},
                     {"color", &T::color, "colour of the velocity arrows"},
                     {"angular_color", &T::angular_color, "colour of the angular velocity arrows"}}
        .with_base<LineLook>();
  }
};
template <>
struct Table<IslandsOverlay> {
  static constexpr const char* kName = "islands_overlay";
  static constexpr const char* kHelp =
      "Islands, groups of dynamic bodies connected by contacts: a box around each body in the colour of its "
      "island.";
  static Fields<IslandsOverlay> fields() {
    using T = IslandsOverlay;
    return Fields<T>{{"asleep", &T::asleep,
                      "brightness of the boxes of sleeping bodies, relative to the other boxes", "",
                      kFraction}}
        .with_base<LineLook>();
  }
};
template <>
struct Table<JointsOverlay> {
  static constexpr const char* kName = "joints_overlay";
  static constexpr const char* kHelp =
      "Joints that are not broken: lines to the centres of their bodies, a ring about the axis of revolute "
      "and prismatic joints, and arrows for their forces.";
  static Fields<JointsOverlay> fields() {
    using T = JointsOverlay;
    return Fields<T>{
        {"joint", &T::joint, "name of a joint; empty: all"},
        {"size", &T::size, "radius of the rings; axes are four times as long", "m", kPositive},
        {"force_scale", &T::force_scale, "length of the arrows per force; 0: no arrows", "m/N", kNotNegative},
        {"color", &T::color, "colour of lines and rings"},
        {"force_color", &T::force_color, "colour of the arrows"}}
        .with_base<LineLook>();
  }
};
template <>
struct Table<ClothOverlay> {
  static constexpr const char* kName = "cloth_overlay";
  static constexpr const char* kHelp =
      "The threads of cloths, coloured by strain: blue is the rest length, red is stretched.";
  static Fields<ClothOverlay> fields() {
    using T = ClothOverlay;
    return Fields<T>{{"cloth", &T::cloth, "name of a cloth; empty: all"},
                     {"strain", &T::strain, "strain at which a thread is red", "", over(0, 10)}}
        .with_base<LineLook>();
  }
};
template <>
struct Table<TrailsOverlay> {
  static constexpr const char* kName = "trails_overlay";
  static constexpr const char* kHelp = "Paths of the centres of mass of bodies.";
  static Fields<TrailsOverlay> fields() {
    using T = TrailsOverlay;
    return Fields<T>{{"body", &T::body, "name of a body; empty: all dynamic bodies"},
                     {"duration", &T::duration,
                      "time before the frame that a trail covers; longer: longer trails", "s", over(0, 60)},
                     {"color", &T::color, "colour of the trails; default: another colour for each body"}}
        .with_base<LineLook>();
  }
};
template <>
struct Names<TextPlace> {
  static constexpr std::array kNames = {"top_left", "top_right", "bottom_left", "bottom_right", "center"};
};
template <>
struct Table<TextOverlay> {
  static constexpr const char* kName = "text_overlay";
  static constexpr const char* kHelp = "Text over the picture.";
  static Fields<TextOverlay> fields() {
    using T = TextOverlay;
    return {
        {"text", &T::text,
         "ASCII text; {time}, {frame}, {bodies} and {particles} are replaced by their values, a line "
         "break starts a new line"},
        {"place", &T::place, "corner of the picture in which the text stands, or its centre"},
        {"size", &T::size,
         "height of a line, as a fraction of the picture's height; less where a line would be wider than the "
         "picture",
         "", over(0, 0.5)},
        {"color", &T::color, "colour of the letters"},
        {"from", &T::from, "time at which the text appears", "s"},
        {"until", &T::until, "time at which the text disappears; default: it stays", "s"}};
  }
};
template <>
struct Tags<Overlay> {
  static constexpr const char* kName = "overlay";
  static constexpr const char* kHelp =
      "Lines or text over the picture that show the state of the simulation.";
  static constexpr std::array kTags = {"tree",    "parts",  "closest", "contacts", "velocities",
                                       "islands", "joints", "cloth",   "trails",   "text"};
  static constexpr bool kRequired = true;
};

}  // namespace offstage::producer
