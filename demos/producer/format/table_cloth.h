#pragma once
/// The keys of cloths: their shapes, fabrics, pins and seams.

#include <array>

#include "producer/format/table_world.h"

namespace offstage::producer {

// --- Shape ---

template <>
struct Table<GridShape> {
  static constexpr const char* kName = "cloth_grid";
  static constexpr const char* kHelp =
      "A rectangle in the plane y = 0 of the cloth's frame, its front towards +Y: left to right along x, top "
      "to bottom along z.";
  static Fields<GridShape> fields() {
    return {{"size", &GridShape::size, "lengths along x and z", "m", kPositive},
            {"cells", &GridShape::cells, "number of cells along x and z", "", between(1, 1000)}};
  }
};
template <>
struct Tags<ClothShape> {
  static constexpr const char* kName = "cloth_shape";
  static constexpr const char* kHelp = "The flat cloth: a rectangle, or the triangles of a model file.";
  static constexpr std::array kTags = {"grid", "mesh"};
  static constexpr bool kRequired = false;
};
template <>
struct Table<FabricChanges> {
  static Fields<FabricChanges> fields() {
    using T = FabricChanges;
    return {
        {"areal_density", &T::areal_density, "mass per area; this and the next: left out, the fabric's",
         "kg/m^2", kPositive},
        {"stretch", &T::stretch, "force per width at a strain of 1, along the threads", "N/m", kPositive},
        {"shear", &T::shear, "the same across them", "N/m", kNotNegative},
        {"bend", &T::bend, "moment per width at a curvature of 1/m", "N m", kNotNegative},
        {"damping", &T::damping, "share of the critical damping of a spring", "", between(0, 10)},
        {"friction", &T::friction, "on bodies; of two the geometric mean counts", "", kNotNegative},
        {"self_friction", &T::self_friction, "of cloth on cloth", "", kNotNegative},
        {"thickness", &T::thickness, "distance kept from bodies and between layers", "m", over(0, 1)},
        {"drag", &T::drag, "coefficient of the pressure of air that comes square", "", kNotNegative},
        {"lift", &T::lift, "of the force across air that comes aslant; at most `drag`", "", kNotNegative},
        {"max_stretch", &T::max_stretch, "greatest length along the threads over that at rest; 0: no limit",
         "", kNotNegative},
        {"max_shear", &T::max_shear, "the same across them", "", kNotNegative},
    };
  }
};

// --- Pins and seams ---

template <>
struct Names<Side> {
  static constexpr std::array kNames = {"left", "right", "top", "bottom"};
};
template <>
struct Names<Corner> {
  static constexpr std::array kNames = {"top_left", "top_right", "bottom_left", "bottom_right"};
};
template <>
struct Table<PinScope> {
  static Fields<PinScope> fields() {
    return {{"body", &PinScope::body,
             "name of the body they are fastened to, where they are at time 0; empty: the world"},
            {"until", &PinScope::until, "when it lets go", "s", kNotNegative}};
  }
};
template <>
struct Table<CornerPin> {
  static constexpr const char* kName = "corner_pin";
  static constexpr const char* kHelp = "Holds corners of a grid.";
  static Fields<CornerPin> fields() {
    return Fields<CornerPin>{{"corners", &CornerPin::corners, "which"}}.with_base<PinScope>();
  }
};
template <>
struct Table<SidePin> {
  static constexpr const char* kName = "side_pin";
  static constexpr const char* kHelp = "Holds a side of a grid.";
  static Fields<SidePin> fields() {
    return Fields<SidePin>{
        {"side", &SidePin::side, "which"},
        {"every", &SidePin::every, "of its vertices each so-manieth, from the first", "", between(1, 1000)}}
        .with_base<PinScope>();
  }
};
template <>
struct Table<NearestPin> {
  static constexpr const char* kName = "nearest_pin";
  static constexpr const char* kHelp = "Holds the vertex nearest to a point.";
  static Fields<NearestPin> fields() {
    return Fields<NearestPin>{{"point", &NearestPin::point, "in the cloth's frame", "m"}}
        .with_base<PinScope>();
  }
};
template <>
struct Table<BoxPin> {
  static constexpr const char* kName = "box_pin";
  static constexpr const char* kHelp = "Holds all vertices in a box.";
  static Fields<BoxPin> fields() {
    return Fields<BoxPin>{
        {"centre", &BoxPin::centre, "of the box, in the cloth's frame", "m"},
        {"size", &BoxPin::size, "full lengths of its edges, along the axes of that frame", "m", kPositive}}
        .with_base<PinScope>();
  }
};
template <>
struct Tags<ClothPin> {
  static constexpr const char* kName = "cloth_pin";
  static constexpr const char* kHelp = "Holds vertices where they are, in the world or on a body.";
  static constexpr std::array kTags = {"corners", "side", "nearest", "box"};
  static constexpr bool kRequired = true;
};
template <>
struct Table<SideSeam> {
  static constexpr const char* kName = "side_seam";
  static constexpr const char* kHelp = "Two sides of a grid that are sewn together, vertex by vertex.";
  static Fields<SideSeam> fields() {
    return {{"a", &SideSeam::a, "one side"},
            {"b", &SideSeam::b, "the other, of as many vertices"},
            {"reversed", &SideSeam::reversed, "the first vertex of one meets the last of the other"}};
  }
};
template <>
struct Table<PointSeam> {
  static constexpr const char* kName = "point_seam";
  static constexpr const char* kHelp = "Two vertices that are sewn together: those nearest to two points.";
  static Fields<PointSeam> fields() {
    return {{"a", &PointSeam::a, "in the cloth's frame", "m"},
            {"b", &PointSeam::b, "in the cloth's frame", "m"}};
  }
};
template <>
struct Tags<ClothSeam> {
  static constexpr const char* kName = "cloth_seam";
  static constexpr const char* kHelp = "What is drawn together, and then holds.";
  static constexpr std::array kTags = {"sides", "points"};
  static constexpr bool kRequired = true;
};

// --- Cloths ---

template <>
struct Names<sim::ClothIntegrator> {
  static constexpr std::array kNames = {"relaxed", "implicit", "symplectic", "rk4"};
};
template <>
struct Table<Cloth> {
  static constexpr const char* kName = "cloth";
  static constexpr const char* kHelp = "Cloth: vertices joined by springs, and triangles between them.";
  static Fields<Cloth> fields() {
    using T = Cloth;
    return Fields<T>{
        {"name", &T::name, "unique; empty: cloth_ and its index"},
        {"shape", &T::shape, "of the flat cloth"},
        {"fabric", &T::fabric, "name of what it is made of; `offstage presets` lists them"},
    }
        .with(&T::changes)
        .then({
            {"material", &T::material, "name of a material; empty: the fabric's own look"},
            {"position", &T::position, "of the cloth's frame at time 0", "m"},
            {"orientation", &T::orientation, "of its axes at time 0"},
            {"velocity", &T::velocity, "at time 0", "m/s"},
            {"pins", &T::pins, "what is held"},
            {"seams", &T::seams, "what is sewn together"},
            {"seam_time", &T::seam_time, "in which seams close", "s", kPositive},
            {"collides", &T::collides, "takes part in collisions with bodies and particles"},
            {"self_collision", &T::self_collision, "collides with itself, and with other cloths that do"},
            {"tear", &T::tear, "length over that at rest at which threads tear, above 1; 0: never", "",
             kNotNegative},
            {"pressure", &T::pressure, "inside of a closed cloth, over that of the air, at its first volume",
             "Pa"},
            {"ram_pressure", &T::ram_pressure,
             "share of the stagnation pressure of the air that comes in at the mouth of an open cloth, which "
             "builds up inside: about 1 for a parachute",
             "", kNotNegative},
            {"air_density", &T::air_density, "of the air it moves in; 0: none", "kg/m^3", kNotNegative},
            {"integrator", &T::integrator,
             "how its springs are stepped; the last two are explicit, for soft cloth and short steps"},
            {"substep", &T::substep, "longest step of its own, never longer than the world's", "s",
             over(0, 1)},
            {"visible", &T::visible, "is drawn"},
            {"casts_shadow", &T::casts_shadow, "throws a shadow"},
        })
        .with(&T::placement);
  }
};

}  // namespace offstage::producer
