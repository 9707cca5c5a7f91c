#pragma once
/// The keys of particles: looks, groups, emitters, child particles, and effects.

#include <array>

#include "producer/format/table_world.h"
#include "producer/format/values.h"
#include "producer/scene/effects.h"

namespace offstage::producer {

inline constexpr Limits kAngles = between(0, 180);
inline constexpr Limits kCounts = between(0, 2e7);
inline constexpr Limits kTemperature = between(500, 15000);

// --- Looks and behaviour ---

template <>
struct Names<LookStyle> {
  static constexpr std::array kNames = {"sprite", "streak", "sphere", "smoke",
                                        "fire",   "flake",  "drop",   "spark"};
};
template <>
struct Names<effects::RampKind> {
  static constexpr std::array kNames = {"linear", "smooth"};
};
template <>
struct Table<ParticleLook> {
  static constexpr const char* kName = "look";
  static constexpr const char* kHelp =
      "How particles are drawn. What is left out is as the style has it: soft round `sprite`; lit `streak` "
      "along its motion that throws a shadow, `drop` one that throws none; lit ball, `sphere`; `smoke` "
      "shadowed by the smoke before it; glowing tongue of `fire`; `flake` of snow or dust; glowing `spark` "
      "with a tail.";
  static Fields<ParticleLook> fields() {
    using T = ParticleLook;
    return {
        {"style", &T::style, "what a particle looks like"},
        {"color", &T::color, "colour; alpha is opacity"},
        {"color_over_age", &T::color_over_age, "multiplies `color`; age 0: birth, 1: end of life"},
        {"temperature_over_age", &T::temperature_over_age,
         "multiplies both by the colour of what glows so hot, and by its brightness beside the hottest key",
         "K", kTemperature},
        {"size_over_age", &T::size_over_age, "multiplies the drawn radius", "", kNotNegative},
        {"ramp", &T::ramp, "between the keys over age"},
        {"color_deviation", &T::color_deviation, "standard deviation of brightness between particles", "",
         kShare},
        {"channel_deviation", &T::channel_deviation,
         "standard deviations of red, green, blue and opacity between particles", "", kNotNegative},
        {"additive", &T::additive, "adds light instead of covering; left out: of sparks and fire"},
        {"lit", &T::lit, "by sun and sky, else its colour is its light; left out: all but sparks and fire"},
        {"casts_shadow", &T::casts_shadow, "throws a shadow; left out: sprites, streaks, spheres and smoke"},
        {"softness", &T::softness, "width of the fade at the rim as a share of the radius; left out: 0.5", "",
         kShare},
        {"stretch", &T::stretch,
         "a streak is as long as its particle moves in this time, smoke, fire and flakes are longer by it; "
         "left "
         "out: 1/60, of sparks 1/40, of fire 0.1, of smoke 0",
         "s", kNotNegative},
        {"taper", &T::taper, "share by which a streak fades towards its tail; left out: 0, of sparks 1", "",
         kShare},
        {"metallic", &T::metallic, "of spheres; 0: dielectric, 1: metal; left out: 0", "", kShare},
        {"roughness", &T::roughness, "of spheres; 0: mirror, 1: dull; left out: 0.3", "", kShare},
    };
  }
};
template <>
struct Table<ParticleBehaviour> {
  static Fields<ParticleBehaviour> fields() {
    using T = ParticleBehaviour;
    return {
        {"linear_drag", &T::linear_drag, "force against the air per speed", "kg/s", kNotNegative},
        {"gravity", &T::gravity, "feels the world's gravity"},
        {"force", &T::force, "constant force on each particle", "N"},
        {"collides", &T::collides, "with bodies"},
        {"internal", &T::internal, "its particles collide with each other"},
        {"external", &T::external, "its particles collide with those of others that have this, too"},
        {"dies_on_hit", &T::dies_on_hit, "is removed at its first collision"},
        {"integrator", &T::integrator,
         "method, for particles without springs; `leapfrog` is of second order at the cost of one evaluation "
         "of the "
         "forces, and stable for any drag"},
    };
  }
};

// --- Groups ---

template <>
struct Table<ParticlePlace> {
  static constexpr const char* kName = "particle";
  static constexpr const char* kHelp = "One particle of a group.";
  static Fields<ParticlePlace> fields() {
    return {{"position", &ParticlePlace::position, "at time 0", "m"},
            {"velocity", &ParticlePlace::velocity, "at time 0", "m/s"},
            {"color", &ParticlePlace::color, "instead of the look's"}};
  }
};
template <>
struct Table<ParticleGroup> {
  static constexpr const char* kName = "particle_group";
  static constexpr const char* kHelp = "Particles placed one by one.";
  static Fields<ParticleGroup> fields() {
    using T = ParticleGroup;
    return Fields<T>{
        {"name", &T::name, "unique; empty: particles_ and its index"},
        {"places", &T::places, "the particles"},
        {"radius", &T::radius, "of each", "m", kPositive},
        {"mass", &T::mass, "of each", "kg", kPositive},
        {"restitution", &T::restitution, "bounciness; the larger of particle and body counts", "", kShare},
        {"friction", &T::friction, "Coulomb's coefficient; the geometric mean of both counts", "",
         kNotNegative},
        {"charge", &T::charge, "of each", "C"},
        {"look", &T::look, "how they are drawn"},
    }
        .with(&T::behaviour);
  }
};

// --- Sources ---

template <>
struct Table<Split> {
  static constexpr const char* kName = "split";
  static constexpr const char* kHelp =
      "Particles that throw off others of the same kind, which can split in their turn. Percentages are of "
      "the "
      "parent's at that time.";
  static Fields<Split> fields() {
    using T = Split;
    return {{"enabled", &T::enabled, "whether they split at all"},
            {"count", &T::count, "children of one split, rounded", "", between(0, 1000)},
            {"age", &T::age, "of a particle at its first split", "s", kPositive},
            {"delay", &T::delay, "to its next split", "s", kPositive},
            {"depth", &T::depth, "the most splits of a particle, those of its ancestors included", "",
             between(1, 16)},
            {"velocity_percent", &T::velocity_percent, "of the parent's velocity", "%"},
            {"spread_deg", &T::spread_deg, "angle from the parent's direction", "degrees", kAngles},
            {"radius_percent", &T::radius_percent, "of the parent's radius", "%", kPositive},
            {"mass_percent", &T::mass_percent, "of the parent's mass; 0: of its density", "%", kNotNegative},
            {"lifespan_percent", &T::lifespan_percent, "of the parent's lifespan", "%", kPositive}};
  }
};
template <>
struct Table<ParticleSource> {
  static Fields<ParticleSource> fields() {
    using T = ParticleSource;
    return Fields<T>{
        {"speed", &T::speed, "of a particle as it leaves", "m/s"},
        {"spread_deg", &T::spread_deg, "angle between its path and the direction it is released in",
         "degrees", kAngles},
        {"radius", &T::radius, "of a particle", "m", kPositive},
        {"density", &T::density, "gives the mass, unless `mass` does", "kg/m^3", kPositive},
        {"mass", &T::mass, "of a particle; 0: from density and radius", "kg", kNotNegative},
        {"lifespan", &T::lifespan, "of a particle", "s", kPositive},
        {"restitution", &T::restitution, "bounciness; the larger of particle and body counts", "", kShare},
        {"friction", &T::friction, "Coulomb's coefficient; the geometric mean of both counts", "",
         kNotNegative},
        {"charge", &T::charge, "of a particle", "C"},
        {"max_alive", &T::max_alive, "no more than this many exist at once", "", between(1, 2e7)},
        {"look", &T::look, "how particles are drawn"},
    }
        .with(&T::behaviour);
  }
};
/// Child particles of any kind of parent.
template <class T>
Fields<T> with_offspring(Fields<T> fields) {
  return std::move(fields).then({
      {"split", &T::split, "its particles throw off others of the same kind"},
      {"trails", &T::trails, "other particles that each of them leaves behind"},
      {"on_age", &T::on_age, "other particles born when one reaches an age"},
      {"on_collision", &T::on_collision, "other particles born where one hits something"},
      {"on_death", &T::on_death, "other particles born where one ends of age"},
  });
}
template <>
struct Table<TrailSource> {
  static constexpr const char* kName = "trail";
  static constexpr const char* kHelp = "Particles that every parent leaves behind, evenly in time.";
  static Fields<TrailSource> fields() {
    using T = TrailSource;
    return with_offspring(Fields<T>{
        {"name", &T::name, "follows the parent's and a slash; empty: trails_ and its index"},
        {"rate", &T::rate, "particles of each parent", "1/s", between(0, 1e5)},
        {"start_age", &T::start_age, "of the parent", "s", kNotNegative},
        {"end_age", &T::end_age, "of the parent", "s", kNotNegative},
        {"velocity_percent", &T::velocity_percent, "of the parent's velocity; `speed` is added, backwards",
         "%"},
    }
                              .with_base<ParticleSource>());
  }
};
template <>
struct Names<effects::Axis> {
  static constexpr std::array kNames = {"normal", "velocity"};
};
/// What events of all kinds have.
template <class T>
Fields<T> event_fields() {
  return with_offspring(Fields<T>{
      {"probability", &T::probability, "that an event is answered", "", kShare},
      {"min_speed", &T::min_speed, "of the parent after the event; slower ones are not answered", "m/s",
       kNotNegative},
      {"count", &T::count, "particles for each event, rounded", "", kCounts},
      {"axis", &T::axis,
       "what they fly about: the normal of what was hit, else as the other; the parent's velocity"},
      {"velocity_percent", &T::velocity_percent, "of the parent's velocity; `speed` is added, about the axis",
       "%"},
      {"max_per_step", &T::max_per_step, "no more than this many are born in a step of the simulation", "",
       between(1, 1e6)},
  }
                            .template with_base<ParticleSource>());
}
template <>
struct Table<EventSource> {
  static constexpr const char* kName = "event_source";
  static constexpr const char* kHelp = "Particles that answer something that happens to a parent.";
  static Fields<EventSource> fields() {
    using T = EventSource;
    return Fields<T>{{"name", &T::name,
                      "follows the parent's and a slash; empty: on_collision_ or on_death_ and its index"}}
        .then(event_fields<T>());
  }
};
template <>
struct Table<AgeSource> {
  static constexpr const char* kName = "age_source";
  static constexpr const char* kHelp = "Particles that are born when a parent reaches an age.";
  static Fields<AgeSource> fields() {
    using T = AgeSource;
    return Fields<T>{{"name", &T::name, "follows the parent's and a slash; empty: on_age_ and its index"},
                     {"age", &T::age, "of the parent", "s", kNotNegative}}
        .then(event_fields<T>());
  }
};

// --- Emitters ---

template <>
struct Table<PlaneSurface> {
  static constexpr const char* kName = "plane_surface";
  static constexpr const char* kHelp = "A rectangle that particles leave along its normal.";
  static Fields<PlaneSurface> fields() {
    return {{"position", &PlaneSurface::position, "of its centre", "m"},
            {"direction", &PlaneSurface::direction, "its normal", "", kDirection},
            {"turn_deg", &PlaneSurface::turn_deg, "turn of the rectangle about its normal", "degrees"},
            {"size", &PlaneSurface::size, "of its two edges", "m", kPositive}};
  }
};
template <>
struct Table<SphereSurface> {
  static constexpr const char* kName = "sphere_surface";
  static constexpr const char* kHelp = "A sphere that particles leave outwards, all around.";
  static Fields<SphereSurface> fields() {
    return {{"position", &SphereSurface::position, "of its centre", "m"},
            {"radius", &SphereSurface::radius, "radius", "m", kPositive}};
  }
};
template <>
struct Table<DiscSurface> {
  static constexpr const char* kName = "disc_surface";
  static constexpr const char* kHelp = "A circle that particles leave along its normal.";
  static Fields<DiscSurface> fields() {
    return {{"position", &DiscSurface::position, "of its centre", "m"},
            {"direction", &DiscSurface::direction, "its normal", "", kDirection},
            {"radius", &DiscSurface::radius, "radius", "m", kPositive}};
  }
};
template <>
struct Table<MeshSurface> {
  static constexpr const char* kName = "mesh_surface";
  static constexpr const char* kHelp = "A model that particles leave along the normals of its faces.";
  static Fields<MeshSurface> fields() {
    return {{"file", &MeshSurface::file, "model file", kRequired},
            {"scale", &MeshSurface::scale, "factor of its size", "", kPositive},
            {"position", &MeshSurface::position, "of the model's origin", "m"},
            {"orientation", &MeshSurface::orientation, "of the model"}};
  }
};
template <>
struct Tags<EmitterSurface> {
  static constexpr const char* kName = "surface";
  static constexpr const char* kHelp =
      "Where particles come from: in the world, or in the frame of the emitter's body.";
  static constexpr std::array kTags = {"plane", "sphere", "disc", "mesh"};
  static constexpr bool kRequired = false;
};
template <>
struct Table<EmitterBurst> {
  static constexpr const char* kName = "burst";
  static constexpr const char* kHelp = "Many particles at once.";
  static Fields<EmitterBurst> fields() {
    return {{"time", &EmitterBurst::time, "of the first cycle", "s", kNotNegative},
            {"count", &EmitterBurst::count, "particles in each cycle, rounded", "", kCounts},
            {"cycles", &EmitterBurst::cycles, "how many times", "", between(1, 1e6)},
            {"interval", &EmitterBurst::interval, "between cycles", "s", kPositive}};
  }
};
template <>
struct Table<effects::TimeWindow> {
  static constexpr const char* kName = "window";
  static constexpr const char* kHelp = "From one time up to, and without, another.";
  static Fields<effects::TimeWindow> fields() {
    return {{"start", &effects::TimeWindow::start, "from when", "s", kNotNegative},
            {"end", &effects::TimeWindow::end, "until when", "s", kNotNegative}};
  }
};
template <>
struct Table<Emitter> {
  static constexpr const char* kName = "emitter";
  static constexpr const char* kHelp = "A source of particles.";
  static Fields<Emitter> fields() {
    using T = Emitter;
    return with_offspring(Fields<T>{
        {"name", &T::name, "unique; also names its random numbers; empty: emitter_ and its index"},
        {"preset", &T::preset,
         "whose first emitter this one is but for the keys given here; of another: \"preset/emitter\"; "
         "empty: "
         "none"},
        {"body", &T::body, "name of the body it moves with; empty: fixed in the world"},
        {"surface", &T::surface, "where particles come from"},
        {"direction", &T::direction,
         "they are released in, in the frame of the body or the world; zero: the surface's normal"},
        {"overlap", &T::overlap,
         "newborns may overlap and never wait for room: for particles that do not collide with each "
         "other"},
        {"rate", &T::rate, "particles released one by one", "1/s", between(0, 1e9)},
        {"count", &T::count, "particles at once in every `interval`, rounded", "", kCounts},
        {"interval", &T::interval, "between releases of `count`", "s", kPositive},
        {"bursts", &T::bursts, "many particles at given times"},
        {"start", &T::start, "of `rate` and `count`", "s", kNotNegative},
        {"end", &T::end, "of everything; the living live on", "s", kNotNegative},
        {"windows", &T::windows, "when `rate` and `count` release; empty: always"},
        {"prewarm", &T::prewarm,
         "how long before `start` it has begun already; until time 0 particles live and collide while "
         "dynamic "
         "bodies, cloths and particle groups stand still, kinematic bodies follow their keys, and forces are "
         "those of time 0",
         "s", kNotNegative},
    }
                              .with_base<ParticleSource>()
                              .with(&T::placement));
  }
};

// --- Effects ---

template <>
struct Codec<Overrides> {
  static void read(Reader& in, const Node& node, const Spec&, Overrides& out) {
    const Object* object = node.as<Object>();
    if (!object) return in.refuse(node, "an object");
    for (const Member& member : *object)
      in.within(member.key, [&] {
        if (!member.value.as<Object>()) in.refuse(member.value, "an object");
      });
    out.node = node;
  }
  static Node write(const Overrides& value) { return value.node; }
  static Description describe(Catalogue&, const Spec&) {
    return {{{"type", "object"}, {"additionalProperties", Object{{"type", "object"}}}}, "object"};
  }
};
template <>
struct Table<Effect> {
  static constexpr const char* kName = "effect";
  static constexpr const char* kHelp =
      "All emitters and forces of a preset, some of their keys replaced. `offstage presets` lists the "
      "presets.";
  static Fields<Effect> fields() {
    using T = Effect;
    return {{"preset", &T::preset, "name of the preset", kRequired},
            {"name", &T::name,
             "stands before those of its emitters and forces, with a slash; empty: the preset's"},
            {"position", &T::position, "of the preset's origin, in the world or in the body's frame", "m"},
            {"body", &T::body, "name of the body that its emitters move with; empty: none"},
            {"start", &T::start, "added to all its times", "s", kNotNegative},
            {"overrides", &T::overrides, "names of its emitters and forces, each with the keys to replace"}};
  }
};

}  // namespace offstage::producer
