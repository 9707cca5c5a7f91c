#pragma once
/// The keys of cloths: their shapes, fabrics, pins and seams.

#include <array>

#include "producer/format/table_placement.h"
#include "producer/format/table_shape.h"
#include "producer/format/values.h"

namespace offstage::producer {

// --- Shape ---

template <>
struct Table<GridShape> {
  static constexpr const char* kName = "cloth_grid";
  static constexpr const char* kHelp =
      "A rectangle in the plane y = 0 of the cloth's frame, with its front towards +Y: left to right is "
      "along x, top to bottom along z.";
  static Fields<GridShape> fields() {
    return {{"size", &GridShape::size, "lengths along x and z", "m", kPositive},
            {"cells", &GridShape::cells, "number of cells along x and z", "", between(1, 1000)}};
  }
};
template <>
struct Table<SphereCloth> {
  static constexpr const char* kName = "cloth_sphere";
  static constexpr const char* kHelp = "A closed sphere around the origin of the cloth's frame.";
  static Fields<SphereCloth> fields() {
    return {{"radius", &SphereCloth::radius, "radius of the sphere", "m", kPositive},
            {"divisions", &SphereCloth::divisions,
             "number of subdivisions of an icosahedron, each of which divides every triangle into four: 3 "
             "gives 642 vertices",
             "", between(0, 6)}};
  }
};
template <>
struct Tags<ClothShape> {
  static constexpr const char* kName = "cloth_shape";
  static constexpr const char* kHelp =
      "The cloth at rest: a rectangle, the triangles of a model file, or a sphere.";
  static constexpr std::array kTags = {"grid", "mesh", "sphere"};
  static constexpr bool kRequired = false;
};
template <>
struct Names<effects::BendModel> {
  static constexpr std::array kNames = {"plate", "springs"};
};
template <>
struct Table<FabricChanges> {
  static Fields<FabricChanges> fields() {
    using T = FabricChanges;
    return {
        {"areal_density", &T::areal_density,
         "mass per area. Default of this key, and of all keys up to `min_bend_radius` that state no other "
         "default: the value of the `fabric`",
         "kg/m^2", kPositive},
        {"stretch", &T::stretch, "stiffness along the threads: tensile force per width at a strain of 1",
         "N/m", kPositive},
        {"shear", &T::shear,
         "stiffness against shear, the change of the angle between the threads: shear force per width at a "
         "shear angle of 1 rad",
         "N/m", kNotNegative},
        {"bend", &T::bend,
         "flexural rigidity, the stiffness against bending: moment per width at a curvature of 1/m", "N m",
         kNotNegative},
        {"bend_damping", &T::bend_damping,
         "damping time of bending: the moment is bend * (curvature + bend_damping * its rate of change)", "s",
         kNotNegative},
        {"bend_model", &T::bend_model,
         "`plate`: a thin plate, whose flexural rigidity is `bend` on any mesh; `springs`: the book's "
         "springs between second neighbours, which resist sharp folds but hardly a slight curvature"},
        {"damping", &T::damping, "damping of the springs, as a fraction of their critical damping", "",
         between(0, 10)},
        {"stretch_damping", &T::stretch_damping,
         "damping of springs along the threads, as a fraction of their critical damping; default: `damping`",
         "", between(0, 10)},
        {"shear_damping", &T::shear_damping,
         "damping of springs diagonally across the cells, as a fraction of their critical damping; default: "
         "`damping`",
         "", between(0, 10)},
        {"bend_spring_damping", &T::bend_spring_damping,
         "damping of springs between second neighbours, as a fraction of their critical damping, with the "
         "`bend_model` `springs`; default: `damping`",
         "", between(0, 10)},
        {"friction", &T::friction,
         "coefficient of friction against bodies; a contact uses the geometric mean of the values of cloth "
         "and body",
         "", kNotNegative},
        {"self_friction", &T::self_friction, "coefficient of friction between cloths", "", kNotNegative},
        {"thickness", &T::thickness, "distance that cloth keeps from bodies and from other layers", "m",
         over(0, 1)},
        {"drag", &T::drag,
         "drag coefficient: pressure of an air flow perpendicular to the cloth over its stagnation pressure",
         "", kNotNegative},
        {"lift", &T::lift, "lift coefficient: force across an oblique air flow; at most `drag`", "",
         kNotNegative},
        {"max_stretch", &T::max_stretch,
         "greatest length along the threads, as a multiple of the rest length; 0: no limit", "",
         kNotNegative},
        {"max_shear", &T::max_shear,
         "greatest length diagonally to the threads, as a multiple of the rest length; 0: no limit", "",
         kNotNegative},
        {"min_bend_radius", &T::min_bend_radius,
         "smallest radius to which the cloth bends from its shape at rest; 0: no limit. The limit works with "
         "either `bend_model` and on any mesh. It has no effect where cells are larger than this radius",
         "m", kNotNegative},
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
             "name of the body to which the vertices are attached, at their positions of time 0; empty: the "
             "vertices stay in the world"},
            {"until", &PinScope::until, "time at which the pin is released", "s", kNotNegative}};
  }
};
template <>
struct Table<CornerPin> {
  static constexpr const char* kName = "corner_pin";
  static constexpr const char* kHelp = "Holds corners of a grid.";
  static Fields<CornerPin> fields() {
    return Fields<CornerPin>{{"corners", &CornerPin::corners, "corners to hold"}}.with_base<PinScope>();
  }
};
template <>
struct Table<SidePin> {
  static constexpr const char* kName = "side_pin";
  static constexpr const char* kHelp = "Holds a side of a grid.";
  static Fields<SidePin> fields() {
    return Fields<SidePin>{
        {"side", &SidePin::side, "side to hold"},
        {"every", &SidePin::every,
         "n, if every n-th vertex of the side is held, starting with the first; 1: all vertices", "",
         between(1, 1000)}}
        .with_base<PinScope>();
  }
};
template <>
struct Table<NearestPin> {
  static constexpr const char* kName = "nearest_pin";
  static constexpr const char* kHelp = "Holds the vertex nearest to a point.";
  static Fields<NearestPin> fields() {
    return Fields<NearestPin>{
        {"point", &NearestPin::point, "point in the cloth's frame; the vertex nearest to it is held", "m"}}
        .with_base<PinScope>();
  }
};
template <>
struct Table<BoxPin> {
  static constexpr const char* kName = "box_pin";
  static constexpr const char* kHelp = "Holds all vertices in a box.";
  static Fields<BoxPin> fields() {
    return Fields<BoxPin>{
        {"centre", &BoxPin::centre, "centre of the box, in the cloth's frame", "m"},
        {"size", &BoxPin::size, "full lengths of the box's edges, along the axes of the cloth's frame", "m",
         kPositive}}
        .with_base<PinScope>();
  }
};
template <>
struct Tags<ClothPin> {
  static constexpr const char* kName = "cloth_pin";
  static constexpr const char* kHelp = "Vertices held at a place in the world or on a body.";
  static constexpr std::array kTags = {"corners", "side", "nearest", "box"};
  static constexpr bool kRequired = true;
};
template <>
struct Table<SideSeam> {
  static constexpr const char* kName = "side_seam";
  static constexpr const char* kHelp = "Two sides of a grid that are sewn together, vertex by vertex.";
  static Fields<SideSeam> fields() {
    return {{"a", &SideSeam::a, "one side"},
            {"b", &SideSeam::b, "the other side, with the same number of vertices"},
            {"reversed", &SideSeam::reversed,
             "whether the first vertex of one side is connected to the last vertex of the other; false: to "
             "the first"}};
  }
};
template <>
struct Table<PointSeam> {
  static constexpr const char* kName = "point_seam";
  static constexpr const char* kHelp =
      "Two vertices that are sewn together: the vertices nearest to two points.";
  static Fields<PointSeam> fields() {
    return {{"a", &PointSeam::a, "first point, in the cloth's frame", "m"},
            {"b", &PointSeam::b, "second point, in the cloth's frame", "m"}};
  }
};
template <>
struct Tags<ClothSeam> {
  static constexpr const char* kName = "cloth_seam";
  static constexpr const char* kHelp = "Vertices that are pulled together and then stay connected.";
  static constexpr std::array kTags = {"sides", "points"};
  static constexpr bool kRequired = true;
};

template <>
struct Table<ClothCord> {
  static constexpr const char* kName = "cloth_cord";
  static constexpr const char* kHelp =
      "A string or spring that hangs on a vertex of a cloth. A cord of one segment is a spring, which also "
      "resists compression. A cord of several segments is a string. Cords have mass and collide with bodies.";
  static Fields<ClothCord> fields() {
    using T = ClothCord;
    return {
        {"from", &T::from, "start of the cord: the vertex nearest to this point, in the cloth's frame", "m"},
        {"to", &T::to, "other end of the cord: its position at time 0, in the cloth's frame", "m"},
        {"held", &T::held,
         "whether the other end is held at its position at time 0, in the world or on `body`; false: it "
         "hangs free"},
        {"body", &T::body, "name of the body that holds the other end; empty: the world"},
        {"until", &T::until, "time at which the other end is released", "s", kNotNegative},
        {"length", &T::length,
         "length of the cord at rest; 0: the distance of its ends at time 0. A longer cord hangs down "
         "between its ends",
         "m", kNotNegative},
        {"segments", &T::segments, "number of segments of the cord", "", between(1, 1000)},
        {"stiffness", &T::stiffness, "tensile force of the cord at a strain of 1", "N", kPositive},
        {"mass_per_length", &T::mass_per_length, "mass of the cord per length", "kg/m", kPositive},
        {"damping", &T::damping,
         "damping of the cord along its length, as a fraction of the critical damping of a segment", "",
         between(0, 10)},
        {"visible", &T::visible, "whether the object is drawn"},
        {"radius", &T::radius, "radius of the drawn cord", "m", kPositive},
        {"material", &T::material, "name of a material; empty: the default material"}};
  }
};

// --- Cloths ---

template <>
struct Names<sim::ClothIntegrator> {
  static constexpr std::array kNames = {"relaxed", "implicit", "symplectic", "rk4"};
};
template <>
struct Table<Cloth> {
  static constexpr const char* kName = "cloth";
  static constexpr const char* kHelp = "Cloth: vertices connected by springs, with triangles between them.";
  static Fields<Cloth> fields() {
    using T = Cloth;
    return Fields<T>{
        {"name", &T::name,
         "name, unique among bodies and cloths; default: cloth_N, where N is the index in the list"},
        {"shape", &T::shape, "shape of the cloth at rest"},
        {"fabric", &T::fabric, "name of the fabric; `offstage presets` lists them"},
    }
        .with(&T::changes)
        .then({
            {"material", &T::material, "name of a material; empty: the appearance of the fabric"},
            {"position", &T::position, "position of the cloth's origin at time 0", "m"},
            {"orientation", &T::orientation, "orientation of the cloth at time 0"},
            {"velocity", &T::velocity, "velocity at time 0, in world axes", "m/s"},
            {"pins", &T::pins, "vertices that are held"},
            {"seams", &T::seams, "vertices that are sewn together"},
            {"cords", &T::cords, "strings and springs that hang on vertices"},
            {"seam_time", &T::seam_time, "time in which seams are pulled together", "s", kPositive},
            {"collides", &T::collides, "whether the cloth collides with bodies and particles"},
            {"self_collision", &T::self_collision,
             "whether the cloth collides with itself, and with other cloths that have `self_collision`"},
            {"tear", &T::tear,
             "length at which threads tear, as a multiple of their rest length: above 1, or 0: they never "
             "tear",
             "", kNotNegative},
            {"pressure", &T::pressure,
             "pressure inside a closed cloth above the pressure of the surrounding air, at the initial "
             "volume",
             "Pa"},
            {"inflate_time", &T::inflate_time,
             "time in which the gas that causes `pressure` flows in, at a constant rate; 0: the gas is "
             "present from the start",
             "s", kNotNegative},
            {"gas_density", &T::gas_density,
             "density of the gas that causes `pressure`; a gas lighter than air gives buoyancy: helium has "
             "0.17, hydrogen 0.084; default: `air_density`",
             "kg/m^3", kNotNegative},
            {"ram_pressure", &T::ram_pressure,
             "for an open cloth: pressure that builds up inside, as a fraction of the stagnation pressure of "
             "the air at its mouth; about 1 for a parachute",
             "", kNotNegative},
            {"air_density", &T::air_density, "density of the surrounding air; 0: no air", "kg/m^3",
             kNotNegative},
            {"integrator", &T::integrator,
             "method that integrates the motion of the springs; `symplectic` and `rk4` are explicit: stable "
             "only for soft cloth and short sub-steps"},
            {"substep", &T::substep,
             "longest step of the cloth, at most one sub-step of the world. With the integrator `relaxed`, "
             "springs divide it into as many shorter steps as their stiffness needs",
             "s", over(0, 1)},
            {"soften", &T::soften,
             "with the integrator `relaxed`: whether springs take a single step in each `substep`, which is "
             "faster. The stiffness of springs that are too stiff for this step is reduced, and a warning "
             "gives the factor"},
            {"appear_at", &T::appear_at,
             "time at which the cloth appears, with its shape of time 0; its pins then connect it to the "
             "bodies, where "
             "these are at that time",
             "s", kNotNegative},
            {"remove_at", &T::remove_at, "time at which the cloth is removed; must be later than `appear_at`",
             "s", kPositive},
            {"visible", &T::visible, "whether the object is drawn"},
            {"casts_shadow", &T::casts_shadow, "whether the object casts a shadow"},
        })
        .with(&T::placement);
  }
};

}  // namespace offstage::producer
