#pragma once
/// The keys of what is simulated: the world, materials, bodies with their shapes and placement, springs.
/// Those of particles are in table_particles.h, those of forces in table_force.h.

#include <array>

#include "producer/build/placement.h"
#include "producer/format/table_fabric.h"
#include "producer/format/values.h"

namespace offstage::producer {

// --- World and materials ---

template <>
struct Names<sim::IntegratorKind> {
  static constexpr std::array kNames = {
      "explicit_euler", "symplectic_euler", "leapfrog",          "midpoint",     "rk4",
      "implicit_euler", "adaptive_euler",   "adaptive_midpoint", "adaptive_rk4", "dormand_prince"};
};
template <>
struct Names<sim::SolverKind> {
  static constexpr std::array kNames = {"exact", "fast", "auto"};
};
template <>
struct Names<sim::ImpactLaw> {
  static constexpr std::array kNames = {"simultaneous", "sequential"};
};
template <>
struct Table<WorldSettings> {
  static constexpr const char* kName = "world";
  static constexpr const char* kHelp = "What holds for everything that is simulated.";
  static Fields<WorldSettings> fields() {
    using T = WorldSettings;
    return {
        {"gravity", &T::gravity, "acceleration of free fall", "m/s^2"},
        {"wind", &T::wind, "velocity of the air, felt by drag", "m/s"},
        {"step", &T::step, "longest step of the simulation; every frame takes the fewest equal ones", "s",
         between(1e-6, 1)},
        {"integrator", &T::integrator, "method for bodies and everything joined by springs"},
        {"integration_error", &T::integration_error,
         "greatest error of a coordinate that an adaptive integrator or `dormand_prince` allows in a step",
         "m", between(1e-14, 1)},
        {"solver", &T::solver,
         "of resting contact: `exact` finds contact forces to rounding and collisions at their very times, "
         "`fast` takes a bounded amount of work, `auto` the exact one where that is not slower"},
        {"impact", &T::impact,
         "of collisions at the same time: all solved together, or one after the other, which lets an impact "
         "pass "
         "through a row of balls"},
        {"collision_speed", &T::collision_speed, "bodies that meet slower than this do not bounce", "m/s",
         over(0, 100)},
        {"sleep", &T::sleep, "bodies at rest are left alone until something happens to them"},
        {"bounds", &T::bounds, "half the edge of the cube that things must stay in", "m", kPositive},
        {"seed", &T::seed, "changes every random number of the scene", "", kNotNegative},
    };
  }
};

template <>
struct Names<render::Pattern> {
  static constexpr std::array kNames = {"none",     "checker", "grid",   "noise",   "brick",
                                        "wood",     "lawn",    "paving", "stripes", "gingham",
                                        "concrete", "sand",    "planks", "water"};
};

template <>
struct Table<Material> {
  static constexpr const char* kName = "material";
  static constexpr const char* kHelp = "Look and contact behaviour in one.";
  static Fields<Material> fields() {
    using T = Material;
    return {
        {"name", &T::name, "what bodies, springs and cloths call it; empty: material_ and its index"},
        {"color", &T::color, "base colour; with alpha below 1 it is translucent, and so is its shadow"},
        {"metallic", &T::metallic, "0: dielectric, 1: metal", "", kShare},
        {"roughness", &T::roughness, "0: mirror, 1: dull", "", kShare},
        {"transmission", &T::transmission,
         "share of the light under the surface that goes through: 1 is glass, its colour what it lets "
         "through; of a cloth, what goes between its threads, as it is",
         "", kShare},
        {"refraction", &T::refraction, "index of refraction of what light goes through", "", between(1, 3)},
        {"emission", &T::emission, "colour of the light it gives off"},
        {"emission_strength", &T::emission_strength, "factor of the emission; 1: as bright as a sunlit white",
         "", kNotNegative},
        {"pattern", &T::pattern, "second colour laid over the first"},
        {"pattern_color", &T::pattern_color, "the pattern's colour"},
        {"pattern_scale", &T::pattern_scale, "size of one cell of the pattern", "m", kPositive},
        {"texture", &T::texture, "image file, multiplies the base colour; empty: none"},
        {"two_sided", &T::two_sided, "lit and drawn from behind too"},
        {"fabric", &T::fabric, "look of threads on cloths; left out: that of the cloth's fabric"},
        {"restitution", &T::restitution, "bounciness; of two the larger counts", "", kShare},
        {"friction", &T::friction,
         "Coulomb's coefficient of what slides; of two the geometric mean counts, as of the next two", "",
         kNotNegative},
        {"static_friction", &T::static_friction,
         "the same of what does not slide, between bodies; left out: `friction`", "", kNotNegative},
        {"cross_friction", &T::cross_friction,
         "the same of sliding across the `friction_axis` of a body, which `friction` must then not be 0 "
         "along; "
         "left out: `friction`",
         "", kNotNegative},
    };
  }
};
template <>
struct Table<ContactRule> {
  static constexpr const char* kName = "contact";
  static constexpr const char* kHelp =
      "What bodies of two materials do to each other, in place of what would follow from each material.";
  static Fields<ContactRule> fields() {
    using T = ContactRule;
    return {
        {"materials", &T::materials, "names of two materials, in any order; may be the same", kRequired},
        {"restitution", &T::restitution, "bounciness; left out: by the materials", "", kShare},
        {"friction", &T::friction,
         "Coulomb's coefficient of what slides, along a grain if there is one, and across it in the same "
         "proportion as by the materials; left out: by the materials",
         "", kNotNegative},
        {"static_friction", &T::static_friction,
         "of what does not slide; left out: `friction` if that is given, else by the materials", "",
         kNotNegative},
    };
  }
};

// --- Shapes ---

template <>
struct Table<sim::Sphere> {
  static constexpr const char* kName = "sphere";
  static constexpr const char* kHelp = "A ball centred on the body.";
  static Fields<sim::Sphere> fields() { return {{"radius", &sim::Sphere::radius, "radius", "m", kPositive}}; }
};
template <>
struct Table<sim::Box> {
  static constexpr const char* kName = "box";
  static constexpr const char* kHelp = "A cuboid centred on the body.";
  static Fields<sim::Box> fields() {
    return {{"size", &sim::Box::size, "full lengths of the edges along x, y and z", "m", kPositive}};
  }
};
template <>
struct Table<sim::Capsule> {
  static constexpr const char* kName = "capsule";
  static constexpr const char* kHelp = "A cylinder along y with half a sphere on each end.";
  static Fields<sim::Capsule> fields() {
    return {{"radius", &sim::Capsule::radius, "radius", "m", kPositive},
            {"height", &sim::Capsule::height, "distance between the centres of the half spheres", "m",
             kNotNegative}};
  }
};
template <>
struct Table<sim::Cylinder> {
  static constexpr const char* kName = "cylinder";
  static constexpr const char* kHelp = "A cylinder along y, centred on the body.";
  static Fields<sim::Cylinder> fields() {
    return {{"radius", &sim::Cylinder::radius, "radius", "m", kPositive},
            {"height", &sim::Cylinder::height, "length along y", "m", kPositive}};
  }
};
template <>
struct Table<sim::Cone> {
  static constexpr const char* kName = "cone";
  static constexpr const char* kHelp = "A cone along y: its base at -height/2, its apex at +height/2.";
  static Fields<sim::Cone> fields() {
    return {{"radius", &sim::Cone::radius, "radius of the base", "m", kPositive},
            {"height", &sim::Cone::height, "length along y", "m", kPositive}};
  }
};
template <>
struct Table<sim::Plane> {
  static constexpr const char* kName = "plane";
  static constexpr const char* kHelp = "Everything below y = 0 of the body's frame; not for dynamic bodies.";
  static Fields<sim::Plane> fields() { return {}; }
};
template <>
struct Table<MeshFile> {
  static constexpr const char* kName = "mesh";
  static constexpr const char* kHelp = "A model file as a shape: its triangles collide and give the mass.";
  static Fields<MeshFile> fields() {
    return {{"file", &MeshFile::file,
             "model file relative to the scene, or the name of one that comes with offstage; FILE#NODE is "
             "one of its nodes",
             kRequired},
            {"scale", &MeshFile::scale, "factor of its size", "", kScale}};
  }
};
template <>
struct Tags<Shape> {
  static constexpr const char* kName = "shape";
  static constexpr const char* kHelp =
      "What a body is like to collide with, and to look at unless it has a `model`.";
  static constexpr std::array kTags = {"sphere", "box", "capsule", "cylinder", "cone", "plane", "mesh"};
  static constexpr bool kRequired = true;
};

// --- Placement ---

template <>
struct Table<Repeat> {
  static constexpr const char* kName = "repeat";
  static constexpr const char* kHelp =
      "Copies in a row or a ring: copy i is turned by i * turn_deg about the vertical through `pivot`, then "
      "moved by "
      "i * offset.";
  static Fields<Repeat> fields() {
    return {{"count", &Repeat::count, "copies, the original included", "", between(1, kMaxCopies)},
            {"offset", &Repeat::offset, "from one copy to the next", "m"},
            {"turn_deg", &Repeat::turn_deg, "from one copy to the next", "degrees"},
            {"pivot", &Repeat::pivot, "a point of the vertical that copies turn about", "m"}};
  }
};
template <>
struct Table<Grid> {
  static constexpr const char* kName = "grid";
  static constexpr const char* kHelp =
      "Copies on a grid, centred on the original in x and z, upwards from it in y.";
  static Fields<Grid> fields() {
    return {{"count", &Grid::count, "copies along x, y and z", "", between(1, kMaxCopies)},
            {"spacing", &Grid::spacing, "between neighbours along x, y and z", "m"}};
  }
};
template <>
struct Table<Scatter> {
  static constexpr const char* kName = "scatter";
  static constexpr const char* kHelp =
      "Copies at random places of a level rectangle centred on the original.";
  static Fields<Scatter> fields() {
    return {{"count", &Scatter::count, "copies", "", between(1, kMaxCopies)},
            {"size", &Scatter::size, "of the rectangle along x and z", "m", kNotNegative},
            {"min_distance", &Scatter::min_distance, "between copies; those that find no place are left out",
             "m", kNotNegative},
            {"turn", &Scatter::turn, "turn each copy about its vertical at random"},
            {"scale", &Scatter::scale, "factor of the size of a body's shape and model", "", kScale},
            {"seed", &Scatter::seed, "another seed, another arrangement", "", kNotNegative}};
  }
};
template <>
struct Table<Placement> {
  static Fields<Placement> fields() {
    return {{"repeat", &Placement::repeat, "copies in a row or a ring"},
            {"grid", &Placement::grid, "copies on a grid"},
            {"scatter", &Placement::scatter, "copies at random places"}};
  }
};

// --- Bodies ---

template <>
struct Names<sim::MotionType> {
  static constexpr std::array kNames = {"static", "kinematic", "dynamic"};
};
template <>
struct Table<ModelLook> {
  static constexpr const char* kName = "model";
  static constexpr const char* kHelp = "A model file drawn instead of the body's shape.";
  static Fields<ModelLook> fields() {
    return {{"file", &ModelLook::file, "model file", kRequired},
            {"scale", &ModelLook::scale, "factor of its size", "", kScale},
            {"position", &ModelLook::position, "of the model's origin in the body's frame", "m"},
            {"orientation", &ModelLook::orientation, "of the model in the body's frame"}};
  }
};
template <>
struct Table<BodyKey> {
  static constexpr const char* kName = "body_key";
  static constexpr const char* kHelp = "A pose of a kinematic body at a time.";
  static Fields<BodyKey> fields() {
    return {{"time", &BodyKey::time, "when; times must increase", "s"},
            {"position", &BodyKey::position, "where; left out: the body's own", "m"},
            {"orientation", &BodyKey::orientation, "how it is turned; left out: the body's own"},
            {"interpolation", &BodyKey::interpolation, "from this key to the next; left out: the body's"}};
  }
};
template <>
struct Table<Body> {
  static constexpr const char* kName = "body";
  static constexpr const char* kHelp = "A rigid body.";
  static Fields<Body> fields() {
    using T = Body;
    return Fields<T>{
        {"name", &T::name, "unique; empty: body_ and its index"},
        {"motion", &T::motion, "never moves, follows its keyframes and spin, or is moved by forces"},
        {"shape", &T::shape, "what it collides with"},
        {"model", &T::model, "model file drawn instead of the shape"},
        {"material", &T::material, "name of a material; empty: grey, or the model file's own"},
        {"position", &T::position, "of the body's origin at time 0", "m"},
        {"orientation", &T::orientation, "of the body's axes at time 0"},
        {"velocity", &T::velocity, "of the centre of mass at time 0; dynamic bodies only", "m/s"},
        {"angular_velocity", &T::angular_velocity, "about the world's axes at time 0; dynamic bodies only",
         "rad/s"},
        {"density", &T::density, "gives the mass, unless `mass` does", "kg/m^3", kPositive},
        {"mass", &T::mass, "of a dynamic body; 0: from density and volume", "kg", kNotNegative},
        {"linear_drag", &T::linear_drag, "force against the air per speed", "kg/s", kNotNegative},
        {"angular_drag", &T::angular_drag, "torque against rotation per angular speed", "kg m^2/s",
         kNotNegative},
        {"friction_axis", &T::friction_axis,
         "direction of the surface's grain in the body's frame, along which `friction` counts and across it "
         "the material's `cross_friction`; zero: none; of two bodies the grain of the first one counts"},
        {"surface_velocity", &T::surface_velocity,
         "of the surface against the body, as of a conveyor belt; in the body's frame", "m/s"},
        {"collides", &T::collides, "takes part in collisions"},
        {"visible", &T::visible, "is drawn"},
        {"casts_shadow", &T::casts_shadow, "throws a shadow"},
        {"keyframes", &T::keyframes, "poses over time; kinematic bodies only"},
        {"interpolation", &T::interpolation, kInterpolationHelp},
        {"loop", &T::loop, "repeat the keyframes for ever; else hold the last"},
        {"spin", &T::spin, "constant rotation about the body's own axes; kinematic bodies only", "rad/s"},
    }
        .with(&T::placement);
  }
};

// --- Springs ---

template <>
struct Table<SpringEnd> {
  static constexpr const char* kName = "spring_end";
  static constexpr const char* kHelp = "A point of the world, of a body, or a particle of a group.";
  static Fields<SpringEnd> fields() {
    return {{"body", &SpringEnd::body, "name of a body; empty: none"},
            {"particles", &SpringEnd::particles, "name of a particle group; empty: none"},
            {"index", &SpringEnd::index, "of the particle in its group", "", between(0, 1e9)},
            {"position", &SpringEnd::position, "in the body's frame, or in the world", "m"}};
  }
};
template <>
struct Table<Spring> {
  static constexpr const char* kName = "spring";
  static constexpr const char* kHelp = "A damped spring between two points.";
  static Fields<Spring> fields() {
    using T = Spring;
    return {
        {"name", &T::name, "unique; empty: spring_ and its index"},
        {"a", &T::a, "one end"},
        {"b", &T::b, "the other end"},
        {"stiffness", &T::stiffness, "force per extension", "N/m", kNotNegative},
        {"damping", &T::damping, "force per speed of extension", "N s/m", kNotNegative},
        {"rest_length", &T::rest_length, "length without force; negative: the distance of the ends at time 0",
         "m"},
        {"visible", &T::visible, "is drawn as a rod"},
        {"radius", &T::radius, "of the rod", "m", kPositive},
        {"material", &T::material, "of the rod, by name; empty: grey"},
    };
  }
};

}  // namespace offstage::producer
