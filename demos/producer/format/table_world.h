#pragma once
/// The keys of the world, materials, bodies and springs. Their shapes are in table_shape.h, their placement
/// in table_placement.h, particles in table_particles.h and forces in table_force.h.

#include <array>

#include "producer/format/table_fabric.h"
#include "producer/format/table_placement.h"
#include "producer/format/table_shape.h"
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
  static constexpr std::array kNames = {"exact", "fast", "auto", "lcp"};
};
template <>
struct Names<sim::ImpactLaw> {
  static constexpr std::array kNames = {"simultaneous", "sequential"};
};
template <>
struct Names<sim::CollisionMethods::NarrowPhase> {
  static constexpr std::array kNames = {"gjk", "vclip"};
};
template <>
struct Names<sim::CollisionMethods::BroadPhase> {
  static constexpr std::array kNames = {"multi_grid", "grid"};
};
template <>
struct Names<sim::CollisionMethods::ImpactTime> {
  static constexpr std::array kNames = {"advancement", "bisection"};
};
template <>
struct Names<sim::CollisionMethods::Trees> {
  static constexpr std::array kNames = {"aabb", "obb", "sphere", "mixed"};
};
template <>
struct Names<sim::TreeSplit> {
  static constexpr std::array kNames = {"mean", "surface_area"};
};
template <>
struct Names<sim::CollisionMethods::MeshPairs> {
  static constexpr std::array kNames = {"parts", "triangles"};
};
template <>
struct Names<sim::ParticleContactMethod> {
  static constexpr std::array kNames = {"relaxation", "lcp"};
};
template <>
struct Table<sim::CollisionMethods> {
  static constexpr const char* kName = "collision_methods";
  static constexpr const char* kHelp =
      "Algorithms of collision detection between bodies. They give the same motion within their tolerances "
      "and differ "
      "in their cost; `offstage bench` compares them.";
  static Fields<sim::CollisionMethods> fields() {
    using T = sim::CollisionMethods;
    return {
        {"narrow_phase", &T::narrow_phase,
         "distance of convex polyhedra: `gjk`, or `vclip`, which walks along their features; round "
         "shapes use GJK "
         "in either case"},
        {"broad_phase", &T::broad_phase,
         "search for pairs that may touch: `multi_grid` has several levels of cells, `grid` has cells of "
         "one size"},
        {"impact_time", &T::impact_time,
         "time of an impact: `advancement` never passes it; `bisection` halves the sub-step of bodies "
         "that overlap at "
         "its end, and misses bodies that passed through each other"},
        {"trees", &T::trees,
         "volumes of the trees over the convex parts and triangles of meshes: axis-aligned boxes, "
         "oriented boxes or spheres; `mixed` has spheres for dynamic bodies and axis-aligned boxes for "
         "the others"},
        {"tree_split", &T::tree_split,
         "rule by which these trees divide their items: the `surface_area` heuristic, or the `mean` of "
         "the midpoints"},
        {"mesh_pairs", &T::mesh_pairs,
         "pieces of two meshes that determine the time of impact: their convex `parts` or their `triangles`; "
         "contact points are always those of the parts, and a compound always uses its parts"},
        {"cell_factor", &T::cell_factor,
         "for `broad_phase: grid`: width of a cell in mean diameters of the bodies", "", between(0.1, 100)}};
  }
};
template <>
struct Table<WorldSettings> {
  static constexpr const char* kName = "world";
  static constexpr const char* kHelp = "Settings of the whole simulation.";
  static Fields<WorldSettings> fields() {
    using T = WorldSettings;
    return {
        {"gravity", &T::gravity, "gravitational acceleration", "m/s^2"},
        {"wind", &T::wind, "velocity of the air; it acts on objects through their drag", "m/s"},
        {"step", &T::max_step,
         "longest sub-step of the simulation; each frame is divided into the fewest equal sub-steps", "s",
         between(1e-6, 1)},
        {"integrator", &T::integrator,
         "integration method of bodies, and of everything connected by springs"},
        {"integration_error", &T::integration_error,
         "greatest error per sub-step of a coordinate that an adaptive integrator or `dormand_prince` allows",
         "m", between(1e-14, 1)},
        {"solver", &T::solver,
         "contact solver: `exact` computes contact forces to rounding and each collision at its own time; "
         "`fast` does a bounded amount of work; `auto` uses `exact` where it is not slower, and resolves "
         "each collision at its own time while at most six bodies are awake; `lcp` is as "
         "`exact`, with forces by Dantzig's and Baraff's pivoting for groups of at most 64 contacts, whose "
         "friction has separate limits along two tangents, and leaves other groups to `exact`"},
        {"impact", &T::impact,
         "how collisions at the same time are resolved: `simultaneous` solves them together; `sequential` "
         "solves one after the other, so that an impact travels through a row of balls"},
        {"collision_speed", &T::collision_speed, "bodies that approach more slowly than this do not bounce",
         "m/s", over(0, 100)},
        {"collision", &T::collision, "algorithms of collision detection"},
        {"particle_contacts", &T::particle_contacts,
         "contact forces of particles that collide with particles: `relaxation`, or `lcp`, which solves "
         "clusters of at most `particle_cluster` contacts by Dantzig's and Baraff's pivoting and the others "
         "by relaxation"},
        {"particle_cluster", &T::particle_cluster,
         "for `particle_contacts: lcp`: greatest number of contacts that are solved together", "",
         between(1, 64)},
        {"sleep", &T::sleep, "bodies at rest are not simulated until something reaches them"},
        {"bounds", &T::bounds, "half the edge of the cube around the origin that all objects must stay in",
         "m", kPositive},
        {"seed", &T::seed, "changes all random numbers of the scene", "", kNotNegative},
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
         "name that bodies, springs and cloths refer to; default: material_N, where N is the index in the "
         "list"},
        {"color", &T::color, "base colour; with an alpha below 1 the surface and its shadow are translucent"},
        {"metallic", &T::metallic, "0: dielectric, 1: metal", "", kFraction},
        {"roughness", &T::roughness, "0: mirror, 1: dull", "", kFraction},
        {"transmission", &T::transmission,
         "fraction of the light that passes through the surface: 1 is glass, which tints the light with its "
         "colour; for cloth, the fraction that passes between the threads without a tint",
         "", kFraction},
        {"refraction", &T::refraction, "index of refraction of a transmitting material", "", between(1, 3)},
        {"emission", &T::emission, "colour of the emitted light"},
        {"emission_strength", &T::emission_strength,
         "factor of the emission; 1 is as bright as a white surface in sunlight", "", kNotNegative},
        {"pattern", &T::pattern, "pattern in a second colour over the base colour"},
        {"pattern_color", &T::pattern_color, "second colour, used by the pattern"},
        {"pattern_scale", &T::pattern_scale, "size of one cell of the pattern", "m", kPositive},
        {"texture", &T::texture, "image file that multiplies the base colour; empty: none"},
        {"texture_projection", &T::texture_projection,
         "`surface` lays the texture by the coordinates of the shape or model, once over a primitive's side "
         "and "
         "over a cloth; `triplanar` projects it along the three axes of the body, without distortion and "
         "seams. "
         "Triplanar is not for cloths"},
        {"texture_scale", &T::texture_scale,
         "size of one copy of the texture: with `surface` a factor of its size, with `triplanar` its width "
         "in "
         "metres",
         "", kScale},
        {"texture_angle_deg", &T::texture_angle_deg,
         "turns the texture counter-clockwise, about its centre or, with `triplanar`, the body's axes",
         "deg"},
        {"two_sided", &T::two_sided, "back faces are lit and drawn as well"},
        {"fabric", &T::fabric, "appearance of the threads on cloths; default: that of the cloth's fabric"},
        {"restitution", &T::restitution,
         "coefficient of restitution; of two materials the larger value is used", "", kFraction},
        {"friction", &T::friction,
         "coefficient of dynamic friction; of two materials the geometric mean is used, as for the next two "
         "keys",
         "", kNotNegative},
        {"static_friction", &T::static_friction,
         "coefficient of static friction between bodies; default: `friction`", "", kNotNegative},
        {"cross_friction", &T::cross_friction,
         "coefficient of dynamic friction across the `friction_axis` of a body; needs a `friction` above 0; "
         "default: `friction`",
         "", kNotNegative},
        {"rolling_friction", &T::rolling_friction,
         "greatest torque against rolling, per contact force, between bodies: the distance by which the "
         "centre of pressure is ahead of the middle of the contact. A ball of radius r decelerates by 5/7 g "
         "times this / r. "
         "Steel on steel has about 1e-5 m, a ball on carpet 1e-3 m; of two materials the larger value is "
         "used",
         "m", kNotNegative},
        {"spinning_friction", &T::spinning_friction,
         "greatest torque against spinning about the contact's normal, per contact force, between bodies: "
         "about 0.6 times `friction` times the radius of the contact area. It shares its limit with sliding "
         "friction; of two materials the larger value is used",
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
        {"restitution", &T::restitution, "coefficient of restitution; default: from the materials", "",
         kFraction},
        {"friction", &T::friction,
         "coefficient of dynamic friction, along the friction axis if there is one; across it, the ratio "
         "given by the materials applies; default: from the materials",
         "", kNotNegative},
        {"static_friction", &T::static_friction,
         "coefficient of static friction; default: `friction` of this rule if given, or else from the "
         "materials",
         "", kNotNegative},
        {"rolling_friction", &T::rolling_friction, "as for materials; default: from the materials", "m",
         kNotNegative},
        {"spinning_friction", &T::spinning_friction, "as for materials; default: from the materials", "m",
         kNotNegative},
    };
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
            {"scale", &ModelLook::scale, kModelScaleHelp, "", kScale},
            {"fit", &ModelLook::fit, kModelFitHelp, "m", kPositive},
            {"position", &ModelLook::position, "position of the model's origin in the body's frame", "m"},
            {"orientation", &ModelLook::orientation, "orientation of the model in the body's frame"}};
  }
};
template <>
struct Table<BodyKey> {
  static constexpr const char* kName = "body_key";
  static constexpr const char* kHelp = "A pose of a kinematic body at a time.";
  static Fields<BodyKey> fields() {
    return {{"time", &BodyKey::time, "time of the key; times must increase", "s"},
            {"position", &BodyKey::position,
             "position of the body at this key; default: the body's `position`", "m"},
            {"orientation", &BodyKey::orientation,
             "orientation of the body at this key; default: the body's `orientation`"},
            {"interpolation", &BodyKey::interpolation,
             "interpolation from this key to the next; default: that of the body"}};
  }
};
template <>
struct Table<ModelAnimation> {
  static constexpr const char* kName = "animation";
  static constexpr const char* kHelp =
      "An animation of a glTF 2.0 file: nodes, skins and morph targets. Only static and kinematic bodies "
      "have "
      "animated shapes. Each node with triangles then collides as they do, and each bone as the convex hull "
      "of "
      "the skin around it.";
  static Fields<ModelAnimation> fields() {
    using T = ModelAnimation;
    return {{"clip", &T::clip, "name of the animation, or its number from 0; empty: the first one"},
            {"speed", &T::speed, "seconds of the animation per second", "", kNotNegative},
            {"start", &T::start, "time at which it starts; until then its first pose is held", "s"},
            {"loop", &T::loop, "starts again at its end; false: its last pose is held"}};
  }
};
template <>
struct Table<Body> {
  static constexpr const char* kName = "body";
  static constexpr const char* kHelp = "A rigid body.";
  static Fields<Body> fields() {
    using T = Body;
    return Fields<T>{
        {"name", &T::name, "unique name; default: body_N, where N is the index in the list"},
        {"motion", &T::motion,
         "`static` bodies never move, `kinematic` bodies follow their keyframes and spin, `dynamic` bodies "
         "are moved by forces"},
        {"shape", &T::shape, "collision shape"},
        {"model", &T::model, "model file drawn instead of the shape"},
        {"animation", &T::animation,
         "animation of the model file that is played. If the file is the body's shape, its moving nodes and "
         "bones "
         "push other bodies; if it is its `model`, they are only drawn"},
        {"material", &T::material, "name of a material; empty: grey, or the materials of the model file"},
        {"position", &T::position, "position of the body's origin at time 0", "m"},
        {"orientation", &T::orientation, "orientation of the body at time 0"},
        {"velocity", &T::velocity, "velocity of the centre of mass at time 0; dynamic bodies only", "m/s"},
        {"angular_velocity", &T::angular_velocity,
         "angular velocity at time 0, in world axes; dynamic bodies only", "rad/s"},
        {"density", &T::density, "density; determines the mass unless `mass` is given", "kg/m^3", kPositive},
        {"mass", &T::mass, "mass of a dynamic body; 0: computed from density and volume", "kg", kNotNegative},
        {"centre", &T::centre, "centre of mass in the body's frame; default: that of the shape", "m"},
        {"inertia", &T::inertia,
         "moments of inertia Ixx, Iyy and Izz about the centre of mass, in the body's axes; default: those "
         "of the "
         "shape about its own centre, for the body's mass",
         "kg m^2", kPositive},
        {"inertia_products", &T::inertia_products,
         "off-diagonal elements Ixy, Iyz and Izx of the inertia matrix; need `inertia`", "kg m^2"},
        {"linear_drag", &T::linear_drag, "drag force per speed relative to the air", "kg/s", kNotNegative},
        {"angular_drag", &T::angular_drag, "drag torque per angular speed", "kg m^2/s", kNotNegative},
        {"friction_axis", &T::friction_axis,
         "direction in the body's frame along which the material's `friction` applies; across it, "
         "`cross_friction` applies; zero: friction is the same in all directions. If both bodies of a "
         "contact have an axis, the one of the body that is listed first in the scene is used"},
        {"surface_velocity", &T::surface_velocity,
         "velocity of the surface relative to the body, as on a conveyor belt; in the body's frame", "m/s"},
        {"collides", &T::collides, "takes part in collisions"},
        {"visible", &T::visible, "is drawn"},
        {"casts_shadow", &T::casts_shadow, "casts a shadow"},
        {"keyframes", &T::keyframes, "poses over time; kinematic bodies only"},
        {"interpolation", &T::interpolation, kInterpolationHelp},
        {"loop", &T::loop, "repeats the keyframes; otherwise the last pose is held"},
        {"appear_at", &T::appear_at,
         "time at which the body appears, at its pose and velocity of time 0; its joints join it to the "
         "other bodies "
         "in their poses of that time",
         "s", kNotNegative},
        {"remove_at", &T::remove_at,
         "time at which the body is removed, with its springs, joints and cloth pins; must be later than "
         "`appear_at`",
         "s", kPositive},
        {"spin", &T::spin, "constant angular velocity in the body's axes; kinematic bodies only", "rad/s"},
    }
        .with(&T::placement);
  }
};

// --- Springs ---

template <>
struct Table<SpringEnd> {
  static constexpr const char* kName = "spring_end";
  static constexpr const char* kHelp = "A point of the world or of a body, or a particle of a group.";
  static Fields<SpringEnd> fields() {
    return {{"body", &SpringEnd::body, "name of a body; empty: none"},
            {"particles", &SpringEnd::particles, "name of a particle group; empty: none"},
            {"index", &SpringEnd::index, "index of the particle in its group", "", between(0, 1e9)},
            {"position", &SpringEnd::position, "position in the body's frame, or in the world", "m"}};
  }
};
template <>
struct Table<Spring> {
  static constexpr const char* kName = "spring";
  static constexpr const char* kHelp = "A damped spring between two points.";
  static Fields<Spring> fields() {
    using T = Spring;
    return {
        {"name", &T::name, "unique name; default: spring_N, where N is the index in the list"},
        {"a", &T::a, "one end"},
        {"b", &T::b, "the other end"},
        {"stiffness", &T::stiffness, "force per extension", "N/m", kNotNegative},
        {"damping", &T::damping, "force per speed of extension", "N s/m", kNotNegative},
        {"rest_length", &T::rest_length, "length without force; negative: the distance of the ends at time 0",
         "m"},
        {"visible", &T::visible, "is drawn as a rod"},
        {"radius", &T::radius, "radius of the rod", "m", kPositive},
        {"material", &T::material, "name of the rod's material; empty: grey"},
    };
  }
};

}  // namespace offstage::producer
