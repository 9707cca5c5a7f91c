#pragma once
/// The keys of overlays: what is drawn over the picture to show how the simulation sees it.

#include <array>

#include "producer/format/values.h"

namespace offstage::producer {

template <>
struct Table<LineLook> {
  static Fields<LineLook> fields() {
    return {{"width", &LineLook::width, "of the lines, as a share of the picture's height", "", over(0, 0.1)},
            {"hidden", &LineLook::hidden, "opacity of lines where they are behind something", "", kShare}};
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
      "The bounding tree of a body with a mesh: the volumes of one level, and the leaves above it.";
  static Fields<TreeOverlay> fields() {
    using T = TreeOverlay;
    return Fields<T>{{"body", &T::body, "name of a body with a mesh", kRequired},
                     {"volume", &T::volume, "boxes along the body's axes, boxes along their own, or balls"},
                     {"level", &T::level,
                      "0: the root; between two whole numbers one level fades into the next; a number or a "
                      "curve over time",
                      "", between(0, 16)}}
        .with_base<LineLook>();
  }
};
template <>
struct Table<PartsOverlay> {
  static constexpr const char* kName = "parts_overlay";
  static constexpr const char* kHelp =
      "The convex parts of a body with a mesh, each in its colour, drawn instead of the body.";
  static Fields<PartsOverlay> fields() {
    using T = PartsOverlay;
    return {
        {"body", &T::body, "name of a body with a mesh", kRequired},
        {"explode", &T::explode,
         "how much farther from the middle the parts are drawn, as a share of their distance; a number or "
         "a curve over time",
         "", between(0, 100)}};
  }
};
template <>
struct Table<ClosestOverlay> {
  static constexpr const char* kName = "closest_overlay";
  static constexpr const char* kHelp =
      "The closest points of two bodies, or the shortest way out where one is in the other.";
  static Fields<ClosestOverlay> fields() {
    using T = ClosestOverlay;
    return Fields<T>{{"a", &T::a, "name of a body", kRequired},
                     {"b", &T::b, "name of another", kRequired},
                     {"color", &T::color, "of bodies apart"},
                     {"penetrating", &T::penetrating, "colour of bodies in each other"}}
        .with_base<LineLook>();
  }
};
template <>
struct Table<ContactsOverlay> {
  static constexpr const char* kName = "contacts_overlay";
  static constexpr const char* kHelp =
      "Contact points of bodies, as rings, and as arrows the direction in which the first is pushed, or what "
      "touches a plane. They are those of the simulation, or by geometry if neither body is dynamic.";
  static Fields<ContactsOverlay> fields() {
    using T = ContactsOverlay;
    return Fields<T>{{"a", &T::a, "name of a body; empty: every pair of bodies that collide"},
                     {"b", &T::b, "name of another; empty: every pair of bodies that collide"},
                     {"margin", &T::margin,
                      "bodies that are not dynamic count as touching if nearer than this", "m", kNotNegative},
                     {"size", &T::size, "radius of the rings; arrows are four times as long", "m", kPositive},
                     {"force_scale", &T::force_scale,
                      "length of arrows per force, which they then show with its friction; 0: arrows of one "
                      "length",
                      "m/N", kNotNegative},
                     {"color", &T::color, "of rings and arrows"}}
        .with_base<LineLook>();
  }
};
template <>
struct Table<VelocitiesOverlay> {
  static constexpr const char* kName = "velocities_overlay";
  static constexpr const char* kHelp = "How fast bodies move, as arrows from their centres of mass.";
  static Fields<VelocitiesOverlay> fields() {
    using T = VelocitiesOverlay;
    return Fields<T>{
        {"body", &T::body, "name of a body; empty: all that are not static"},
        {"scale", &T::scale, "length of arrows per speed", "s", kNotNegative},
        {"angular_scale", &T::angular_scale,
         "length of arrows along the axis of rotation per angular speed; 0: none", "m s/rad", kNotNegative},
        {"color", &T::color, "of arrows of velocity"},
        {"angular_color", &T::angular_color, "of arrows of angular velocity"}}
        .with_base<LineLook>();
  }
};
template <>
struct Table<IslandsOverlay> {
  static constexpr const char* kName = "islands_overlay";
  static constexpr const char* kHelp =
      "Groups of dynamic bodies that touch each other directly or through others: a box around each body in "
      "the colour of its group.";
  static Fields<IslandsOverlay> fields() {
    using T = IslandsOverlay;
    return Fields<T>{{"asleep", &T::asleep, "brightness of bodies that are asleep", "", kShare}}
        .with_base<LineLook>();
  }
};
template <>
struct Table<JointsOverlay> {
  static constexpr const char* kName = "joints_overlay";
  static constexpr const char* kHelp =
      "Joints that hold: lines to the centres of their bodies, a ring about the axis of those that turn or "
      "slide, and "
      "as arrows what they bear.";
  static Fields<JointsOverlay> fields() {
    using T = JointsOverlay;
    return Fields<T>{
        {"joint", &T::joint, "name of a joint; empty: all"},
        {"size", &T::size, "radius of the rings; axes are four times as long", "m", kPositive},
        {"force_scale", &T::force_scale, "length of arrows per force; 0: none", "m/N", kNotNegative},
        {"color", &T::color, "of lines and rings"},
        {"force_color", &T::force_color, "of arrows"}}
        .with_base<LineLook>();
  }
};
template <>
struct Table<ClothOverlay> {
  static constexpr const char* kName = "cloth_overlay";
  static constexpr const char* kHelp =
      "The threads of cloths, in colours of their strain: blue at rest, red where they are stretched.";
  static Fields<ClothOverlay> fields() {
    using T = ClothOverlay;
    return Fields<T>{{"cloth", &T::cloth, "name of a cloth; empty: all"},
                     {"strain", &T::strain, "at which a thread is red", "", over(0, 10)}}
        .with_base<LineLook>();
  }
};
template <>
struct Table<TrailsOverlay> {
  static constexpr const char* kName = "trails_overlay";
  static constexpr const char* kHelp = "Where the centres of mass of bodies have been.";
  static Fields<TrailsOverlay> fields() {
    using T = TrailsOverlay;
    return Fields<T>{{"body", &T::body, "name of a body; empty: all dynamic ones"},
                     {"duration", &T::duration, "how far back a trail goes", "s", over(0, 60)},
                     {"color", &T::color, "default: a colour of its own for each"}}
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
  static constexpr const char* kHelp = "Words on the picture.";
  static Fields<TextOverlay> fields() {
    using T = TextOverlay;
    return {{"text", &T::text,
             "ASCII; {time}, {frame}, {bodies} and {particles} stand for the film's figures, a line break "
             "for one"},
            {"place", &T::place, "where in the picture"},
            {"size", &T::size, "height of a line, as a share of the picture's", "", over(0, 0.5)},
            {"color", &T::color, "of the letters"},
            {"from", &T::from, "when it appears", "s"},
            {"until", &T::until, "when it goes; default: it stays", "s"}};
  }
};
template <>
struct Tags<Overlay> {
  static constexpr const char* kName = "overlay";
  static constexpr const char* kHelp = "Something drawn over the picture to show how the simulation sees it.";
  static constexpr std::array kTags = {"tree",    "parts",  "closest", "contacts", "velocities",
                                       "islands", "joints", "cloth",   "trails",   "text"};
  static constexpr bool kRequired = true;
};

}  // namespace offstage::producer
