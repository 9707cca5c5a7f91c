#pragma once
/// The key `world`: settings of the whole simulation, and the algorithms of collision detection.

#include <array>

#include "producer/format/values.h"

namespace offstage::producer {

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
      "and differ in their cost; `offstage bench` compares them.";
  static Fields<sim::CollisionMethods> fields() {
    using T = sim::CollisionMethods;
    return {{"narrow_phase", &T::narrow_phase,
             "algorithm for the distance of convex polyhedra: `gjk`, or `vclip`, which steps from feature to "
             "feature (vertices, edges, faces); round shapes use GJK in either case"},
            {"broad_phase", &T::broad_phase,
             "search for pairs of bodies that may touch: `multi_grid` is a grid with cells of several sizes, "
             "`grid` has cells of one size"},
            {"impact_time", &T::impact_time,
             "search for the time of an impact: `advancement` approaches the impact in safe steps and never "
             "misses it; `bisection` halves the sub-step of bodies that overlap at its end, and misses "
             "bodies that passed through each other"},
            {"trees", &T::trees,
             "volumes of the trees that bound the convex parts and triangles of meshes: axis-aligned boxes "
             "(`aabb`), oriented boxes (`obb`) or spheres; `mixed` has spheres for dynamic bodies and "
             "axis-aligned boxes for the others"},
            {"tree_split", &T::tree_split,
             "rule by which bounding trees divide their items: the `surface_area` heuristic, or the `mean` "
             "of the midpoints"},
            {"mesh_pairs", &T::mesh_pairs,
             "pieces of two meshes that are tested for the time of impact: their convex `parts` or their "
             "`triangles`. Contact points always come from the parts, and a compound always uses its parts"},
            {"cell_factor", &T::cell_factor,
             "for `broad_phase: grid`: width of a cell, as a multiple of the mean diameter of the bodies", "",
             between(0.1, 100)}};
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
         "longest sub-step of the simulation; each frame is divided into the fewest equal sub-steps that are "
         "not longer, and those in which a body would pass cloth are divided further. A shorter step is more "
         "accurate and takes more time",
         "s", between(1e-6, 1)},
        {"integrator", &T::integrator,
         "method that integrates the motion of bodies, and of everything connected by springs"},
        {"integration_error", &T::integration_error,
         "for an adaptive integrator or `dormand_prince`: greatest error of a coordinate per sub-step; a "
         "smaller error takes more time",
         "m", between(1e-14, 1)},
        {"solver", &T::solver,
         "contact solver: `exact` computes contact forces to rounding accuracy, and each collision at its "
         "own time; `fast` does a bounded amount of work; `auto` uses `exact` where it is not slower, and "
         "resolves each collision at its own time while at most six bodies are awake; `lcp` works as "
         "`exact`, except that groups of at most 64 contacts get their forces by Dantzig's and Baraff's "
         "pivoting, with separate limits of friction along two tangents"},
        {"impact", &T::impact,
         "how collisions at the same time are resolved: `simultaneous` solves them together; `sequential` "
         "solves one after the other, so that an impact travels through a row of balls"},
        {"collision_speed", &T::collision_speed, "smallest speed of approach at which bodies bounce", "m/s",
         over(0, 100)},
        {"collision", &T::collision, "algorithms of collision detection"},
        {"particle_contacts", &T::particle_contacts,
         "contact forces of particles that collide with particles: `relaxation`, or `lcp`, which solves "
         "clusters of at most `particle_cluster` contacts, without dynamic bodies, by Dantzig's and Baraff's "
         "pivoting and the others by relaxation"},
        {"particle_cluster", &T::particle_cluster,
         "for `particle_contacts: lcp`: greatest number of contacts that are solved together", "",
         between(1, 64)},
        {"sleep", &T::sleep, "whether the simulation skips bodies at rest until something reaches them"},
        {"bounds", &T::bounds,
         "half the length of an edge of the cube around the origin that contains the scene. A body that "
         "leaves the cube stops for the rest of the film; a particle that leaves it is removed",
         "m", kPositive},
        {"seed", &T::seed, "seed of all random numbers of the scene", "", kNotNegative},
    };
  }
};

}  // namespace offstage::producer
