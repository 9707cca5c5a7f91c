#pragma once
/// The keys of an entry of `emitters`: its surface, the times at which it releases particles, and the
/// properties of the particles. Particles can split and leave trails. They can also release other particles
/// at an age, a death or a collision.

#include <array>

#include "producer/format/table_particle_look.h"
#include "producer/format/table_particles.h"
#include "producer/format/table_placement.h"
#include "producer/format/table_shape.h"
#include "producer/format/values.h"

namespace offstage::producer {

inline constexpr Limits kAngles = between(0, 180);
inline constexpr Limits kCounts = between(0, 2e7);

template <>
struct Table<Split> {
  static constexpr const char* kName = "split";
  static constexpr const char* kHelp =
      "Particles that release children of the same kind, which can split again. Percentages refer to the "
      "parent's value at the time of the split.";
  static Fields<Split> fields() {
    using T = Split;
    return {{"enabled", &T::enabled, "whether particles split at all"},
            {"count", &T::count, "number of children per split, rounded to an integer", "", between(0, 1000)},
            {"age", &T::age, "age of a particle at its first split", "s", kPositive},
            {"delay", &T::delay, "time from one split of a particle to its next", "s", kPositive},
            {"delay_steps", &T::delay_steps,
             "instead of `delay`: time from one split of a particle to its next, as a number of sub-steps of "
             "`world.step`; 0: `delay` applies",
             "", between(0, 1e6)},
            {"depth", &T::depth,
             "largest number of splits in the history of a particle, including the splits of its ancestors",
             "", between(1, 16)},
            {"velocity_percent", &T::velocity_percent,
             "percentage of the parent's velocity that a child starts with", "%"},
            {"spread_deg", &T::spread_deg, "angle between a child's direction of motion and its parent's",
             "degrees", kAngles},
            {"radius_percent", &T::radius_percent,
             "radius of a child, as a percentage of the parent's radius", "%", kPositive},
            {"mass_percent", &T::mass_percent,
             "mass of a child, as a percentage of the parent's mass; 0: the same density as the parent", "%",
             kNotNegative},
            {"lifespan_percent", &T::lifespan_percent,
             "lifespan of a child, as a percentage of the parent's lifespan", "%", kPositive}};
  }
};
template <>
struct Table<ParticleSource> {
  static Fields<ParticleSource> fields() {
    using T = ParticleSource;
    return Fields<T>{
        {"speed", &T::speed, "speed of a new particle", "m/s"},
        {"spread_deg", &T::spread_deg, "angle between a particle's velocity and the direction of the release",
         "degrees", kAngles},
        {"radius", &T::radius, "radius of a particle", "m", kPositive},
        {"density", &T::density, "density of a particle; determines the mass unless `mass` is given",
         "kg/m^3", kPositive},
        {"mass", &T::mass, "mass of a particle; 0: computed from density and radius", "kg", kNotNegative},
        {"lifespan", &T::lifespan, "age at which a particle is removed", "s", kPositive},
        {"restitution", &T::restitution,
         "coefficient of restitution; a contact uses the larger value of particle and body", "", kFraction},
        {"friction", &T::friction,
         "coefficient of dynamic friction; a contact uses the geometric mean of the values of particle and "
         "body",
         "", kNotNegative},
        {"charge", &T::charge, "electric charge of a particle", "C"},
        {"max_alive", &T::max_alive,
         "greatest number of particles of this source that exist at once; further particles are not released",
         "", between(1, 2e7)},
        {"look", &T::look, "how particles are drawn"},
    }
        .with(&T::behaviour);
  }
};
/// Appends the keys of child particles, which all sources of particles have.
template <class T>
Fields<T> with_offspring(Fields<T> fields) {
  return std::move(fields).then({
      {"split", &T::split, "how particles split into children of the same kind"},
      {"trails", &T::trails, "other particles that each particle leaves along its path"},
      {"on_age", &T::on_age, "other particles that are created when a particle reaches an age"},
      {"on_collision", &T::on_collision, "other particles that are created when a particle collides"},
      {"on_death", &T::on_death, "other particles that are created when a particle reaches its lifespan"},
  });
}
template <>
struct Table<TrailSource> {
  static constexpr const char* kName = "trail";
  static constexpr const char* kHelp =
      "Particles that each particle of the parent source leaves along its path, evenly in time.";
  static Fields<TrailSource> fields() {
    using T = TrailSource;
    return with_offspring(Fields<T>{
        {"name", &T::name,
         "last part of the full name, after the parent's name and a slash; default: trails_N, where N is the "
         "index in the list"},
        {"rate", &T::rate, "particles released per second by each parent", "1/s", between(0, 1e5)},
        {"start_age", &T::start_age, "age of the parent at which the trail starts", "s", kNotNegative},
        {"end_age", &T::end_age, "age of the parent at which the trail ends", "s", kNotNegative},
        {"velocity_percent", &T::velocity_percent,
         "percentage of the parent's velocity that a new particle starts with; `speed` is added backwards",
         "%"},
    }
                              .with_base<ParticleSource>());
  }
};
template <>
struct Names<effects::Axis> {
  static constexpr std::array kNames = {"normal", "velocity"};
};
/// Returns the keys that all sub-emitters have: `on_collision`, `on_death` and `on_age`.
template <class T>
Fields<T> event_fields() {
  return with_offspring(Fields<T>{
      {"probability", &T::probability,
       "probability that an event (a collision, a death or an age) creates particles", "", kFraction},
      {"min_speed", &T::min_speed,
       "least speed of the parent after the event; slower parents create no particles", "m/s", kNotNegative},
      {"count", &T::count, "number of particles for each event, rounded", "", kCounts},
      {"axis", &T::axis,
       "axis of the release: `velocity` is the parent's velocity; `normal` is the normal of the surface that "
       "the parent hit, or the parent's velocity if it hit none"},
      {"velocity_percent", &T::velocity_percent,
       "percentage of the parent's velocity that a new particle starts with; `speed` is added along the axis",
       "%"},
      {"max_per_step", &T::max_per_step, "largest number of particles created in one sub-step", "",
       between(1, 1e6)},
  }
                            .template with_base<ParticleSource>());
}
template <>
struct Table<EventSource> {
  static constexpr const char* kName = "event_source";
  static constexpr const char* kHelp = "Particles that are created by a collision or by the end of a parent.";
  static Fields<EventSource> fields() {
    using T = EventSource;
    return Fields<T>{{"name", &T::name,
                      "last part of the full name, after the parent's name and a slash; empty: "
                      "on_collision_N or on_death_N, where N is the index in the list"}}
        .then(event_fields<T>());
  }
};
template <>
struct Table<AgeSource> {
  static constexpr const char* kName = "age_source";
  static constexpr const char* kHelp = "Particles that are created when a parent reaches an age.";
  static Fields<AgeSource> fields() {
    using T = AgeSource;
    return Fields<T>{{"name", &T::name,
                      "last part of the full name, after the parent's name and a slash; default: on_age_N, "
                      "where N is the index in the list"},
                     {"age", &T::age, "age of the parent", "s", kNotNegative}}
        .then(event_fields<T>());
  }
};

template <>
struct Table<PlaneSurface> {
  static constexpr const char* kName = "plane_surface";
  static constexpr const char* kHelp = "A rectangle that releases particles along its normal.";
  static Fields<PlaneSurface> fields() {
    return {{"position", &PlaneSurface::position, "centre of the rectangle, in the emitter's frame", "m"},
            {"direction", &PlaneSurface::direction, "normal of the rectangle, in the emitter's frame", "",
             kDirection},
            {"turn_deg", &PlaneSurface::turn_deg, "rotation of the rectangle about its normal", "degrees"},
            {"size", &PlaneSurface::size, "lengths of the two edges of the rectangle", "m", kPositive}};
  }
};
template <>
struct Table<SphereSurface> {
  static constexpr const char* kName = "sphere_surface";
  static constexpr const char* kHelp = "A sphere that releases particles outwards in all directions.";
  static Fields<SphereSurface> fields() {
    return {{"position", &SphereSurface::position, "centre of the sphere, in the emitter's frame", "m"},
            {"radius", &SphereSurface::radius, "radius of the sphere", "m", kPositive}};
  }
};
template <>
struct Table<DiscSurface> {
  static constexpr const char* kName = "disc_surface";
  static constexpr const char* kHelp = "A disc that releases particles along its normal.";
  static Fields<DiscSurface> fields() {
    return {
        {"position", &DiscSurface::position, "centre of the disc, in the emitter's frame", "m"},
        {"direction", &DiscSurface::direction, "normal of the disc, in the emitter's frame", "", kDirection},
        {"radius", &DiscSurface::radius, "radius of the disc", "m", kPositive}};
  }
};
template <>
struct Table<MeshSurface> {
  static constexpr const char* kName = "mesh_surface";
  static constexpr const char* kHelp = "A model that releases particles along the normals of its faces.";
  static Fields<MeshSurface> fields() {
    return {
        {"file", &MeshSurface::file, kModelFileHelp, kRequired},
        {"scale", &MeshSurface::scale, kModelScaleHelp, "", kPositive},
        {"position", &MeshSurface::position, "position of the model's origin, in the emitter's frame", "m"},
        {"orientation", &MeshSurface::orientation, "orientation of the model, in the emitter's frame"}};
  }
};
template <>
struct Names<Face> {
  static constexpr std::array kNames = {"top", "bottom", "left", "right", "front", "back"};
};
template <>
struct Table<FaceSurface> {
  static constexpr const char* kName = "face_surface";
  static constexpr const char* kHelp =
      "A face of the emitter's body, which releases particles along its normal: a face of a box, or the flat "
      "top or bottom of a cylinder, cone or frustum. Without a body, it is a face of the cuboid that "
      "`position` and `size` give.";
  static Fields<FaceSurface> fields() {
    using T = FaceSurface;
    return {{"face", &T::face,
             "face that releases particles: top and bottom are at +y and -y, right and left at +x and -x, "
             "front and back at +z and -z"},
            {"position", &T::position, "centre of the cuboid in the world, if the emitter has no body", "m"},
            {"size", &T::size, "lengths of the cuboid's edges along x, y and z, if the emitter has no body",
             "m", kPositive}};
  }
};
template <>
struct Tags<EmitterSurface> {
  static constexpr const char* kName = "surface";
  static constexpr const char* kHelp =
      "Surface that particles are released from. Its coordinates are in the frame of the emitter's body, or "
      "in the world.";
  static constexpr std::array kTags = {"plane", "sphere", "disc", "mesh", "face"};
  static constexpr bool kRequired = false;
};
template <>
struct Table<effects::Burst> {
  static constexpr const char* kName = "burst";
  static constexpr const char* kHelp = "Many particles released at once.";
  static Fields<effects::Burst> fields() {
    return {{"time", &effects::Burst::time, "time of the first release", "s", kNotNegative},
            {"count", &effects::Burst::count, "number of particles in each release, rounded", "", kCounts},
            {"cycles", &effects::Burst::cycles, "number of releases", "", between(1, 1e6)},
            {"interval", &effects::Burst::interval, "time between releases", "s", kPositive}};
  }
};
template <>
struct Table<effects::TimeWindow> {
  static constexpr const char* kName = "window";
  static constexpr const char* kHelp = "A period of time. The start is included, the end is not.";
  static Fields<effects::TimeWindow> fields() {
    return {{"start", &effects::TimeWindow::start, "start of the period", "s", kNotNegative},
            {"end", &effects::TimeWindow::end, "end of the period", "s", kNotNegative}};
  }
};
template <>
struct Table<Emitter> {
  static constexpr const char* kName = "emitter";
  static constexpr const char* kHelp = "A source of particles.";
  static Fields<Emitter> fields() {
    using T = Emitter;
    return with_offspring(Fields<T>{
        {"name", &T::name,
         "unique name, which also selects the random numbers; default: emitter_N, where N is the index in "
         "the list"},
        {"preset", &T::preset,
         "preset whose first emitter provides all keys that are not given here; \"preset/emitter\" names "
         "another of its emitters; empty: none"},
        {"body", &T::body,
         "name of the body with which the emitter moves; nothing is released while the body does not exist; "
         "empty: fixed in the world"},
        {"surface", &T::surface, "surface that particles are released from"},
        {"direction", &T::direction,
         "direction of release, in the frame of the body or in the world; zero: the normal of the surface"},
        {"inherit_velocity", &T::inherit_velocity,
         "fraction of the body's velocity at the point of release that is added to a new particle's own "
         "velocity",
         "", kNotNegative},
        {"recoil", &T::recoil,
         "whether each new particle pushes the body back with its momentum relative to the body; dynamic "
         "bodies only"},
        {"overlap", &T::overlap,
         "whether new particles may overlap, so that they never wait for space; only for particles that do "
         "not collide with each other. With `false`, particles that are released together do not overlap, "
         "and those of an `internal` or `external` emitter wait until living ones have left"},
        {"rate", &T::rate, "number of particles released one by one per second", "1/s", between(0, 1e9)},
        {"rate_per_metre", &T::rate_per_metre,
         "number of particles released evenly along each metre of the path of the body, in addition to "
         "`rate`, `count` and `bursts`; needs a `body`",
         "1/m", between(0, 1e9)},
        {"count", &T::count, "number of particles released together in every `interval`, rounded", "",
         kCounts},
        {"interval", &T::interval, "time from one release of `count` particles to the next", "s", kPositive},
        {"bursts", &T::bursts, "releases of many particles at given times"},
        {"start", &T::start, "time at which releases by `rate` and `count` start", "s", kNotNegative},
        {"end", &T::end,
         "time at which all releases end; particles that exist at that time stay until the end of their "
         "lifespan",
         "s", kNotNegative},
        {"windows", &T::windows,
         "periods to which releases by `rate` and `count` are limited; empty: no limits"},
        {"prewarm", &T::prewarm,
         "time for which the emitter has already been running at `start`. Until time 0, particles move and "
         "collide while dynamic bodies, cloths and particle groups stand still, kinematic bodies follow "
         "their keys, and forces have their values of time 0",
         "s", between(0, 3600)},
    }
                              .with_base<ParticleSource>()
                              .with(&T::placement));
  }
};

}  // namespace offstage::producer
