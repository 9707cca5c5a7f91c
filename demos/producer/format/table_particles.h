#pragma once
/// The keys of an entry of `particles`, a group of particles that are placed one by one. Also the keys for
/// the motion and the collisions of particles, which groups and emitters have in common.

#include "producer/format/table_particle_look.h"
#include "producer/format/table_placement.h"
#include "producer/format/table_world.h"
#include "producer/format/values.h"

namespace offstage::producer {

template <>
struct Table<sim::ParticleSystemDef> {
  static Fields<sim::ParticleSystemDef> fields() {
    using T = sim::ParticleSystemDef;
    return {
        {"linear_drag", &T::linear_drag,
         "drag force on each particle per speed relative to the air; 0: no drag", "kg/s", kNotNegative},
        {"gravity", &T::gravity, "whether the world's gravity acts on the particles"},
        {"force", &T::force, "constant force on each particle", "N"},
        {"collides", &T::collides, "whether the particles collide with bodies"},
        {"internal", &T::internal, "whether particles of this system collide with each other"},
        {"external", &T::external,
         "whether particles collide with particles of other systems that also have `external`"},
        {"rotates", &T::rotates,
         "contacts turn the particles as solid balls, so that they roll and friction acts at their surface; "
         "otherwise they slide without turning. Objects of the style `mesh` show the rotation. Sand and "
         "other granular materials need it to flow and heap"},
        {"dies_on_hit", &T::dies_on_hit, "whether a particle is removed at its first collision"},
        {"integrator", &T::integrator,
         "method that integrates the motion of particles without springs; `leapfrog` is of second order, "
         "needs one evaluation of the forces per sub-step, and is stable for any drag"},
    };
  }
};

template <>
struct Table<ParticlePlace> {
  static constexpr const char* kName = "particle";
  static constexpr const char* kHelp = "One particle of a group.";
  static Fields<ParticlePlace> fields() {
    return {{"position", &ParticlePlace::position, "position of the particle at time 0", "m"},
            {"velocity", &ParticlePlace::velocity, "velocity at time 0, in world axes", "m/s"},
            {"color", &ParticlePlace::color, "colour of the particle, instead of the colour of the `look`"}};
  }
};
template <>
struct Table<ParticleGroup> {
  static constexpr const char* kName = "particle_group";
  static constexpr const char* kHelp = "Particles placed one by one, or as the points of a file.";
  static Fields<ParticleGroup> fields() {
    using T = ParticleGroup;
    return Fields<T>{
        {"name", &T::name, "unique name; default: particles_N, where N is the index in the list"},
        {"places", &T::places, "one entry for each particle"},
        {"fill", &T::fill, "volume that is filled with further particles"},
        {"file", &T::file,
         "PLY or OBJ file whose points become further particles, after the particles of `places`, with the "
         "colours of the points; empty: none"},
        {"scale", &T::scale,
         "scale factor of the file's points; `auto` converts the likely unit of the file to metres "
         "(docs/models.md)",
         "", kScale},
        {"fit", &T::fit,
         "lengths of the edges of a box along the axes of the file. The points get the largest size that "
         "fits into the box; `scale` then multiplies that size",
         "m", kPositive},
        {"position", &T::position, "position of the origin of `file` in the world", "m"},
        {"orientation", &T::orientation, "orientation of the axes of `file` in the world"},
        {"max_points", &T::max_points,
         "greatest number of points read from `file`; a larger file is thinned evenly to this number", "",
         between(1, 2e7)},
        {"radius", &T::radius, "radius of each particle", "m", kPositive},
        {"mass", &T::mass, "mass of each particle", "kg", kPositive},
        {"restitution", &T::restitution,
         "coefficient of restitution; a contact uses the larger value of particle and body", "", kFraction},
        {"friction", &T::friction,
         "coefficient of dynamic friction; a contact uses the geometric mean of the values of particle and "
         "body",
         "", kNotNegative},
        {"charge", &T::charge, "electric charge of each particle", "C"},
        {"appear_at", &T::appear_at, "time at which the particles appear", "s", kNotNegative},
        {"remove_at", &T::remove_at,
         "time at which the particles are removed; must be later than `appear_at`", "s", kPositive},
        {"look", &T::look, "how the particles are drawn"},
    }
        .with(&T::behaviour);
  }
};

}  // namespace offstage::producer
