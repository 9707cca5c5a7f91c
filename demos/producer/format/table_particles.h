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
  static constexpr std::array kNames = {"sprite", "streak", "sphere", "smoke", "fire",
                                        "flake",  "drop",   "spark",  "mesh"};
};
template <>
struct Names<effects::RampKind> {
  static constexpr std::array kNames = {"linear", "smooth"};
};
/// Numbers of the stage's structs, which are read as all others.
template <>
struct Codec<float> {
  static void read(Reader& in, const Node& node, const Spec& spec, float& out) {
    Real value = static_cast<Real>(out);
    Codec<Real>::read(in, node, spec, value);
    out = static_cast<float>(value);
  }
  static Node write(const float& value) { return Codec<Real>::write(static_cast<Real>(value)); }
  static Description describe(Catalogue& all, const Spec& spec) { return Codec<Real>::describe(all, spec); }
};
template <>
struct Table<render::SpriteSheet> {
  static constexpr const char* kName = "sheet";
  static constexpr const char* kHelp =
      "Division of a sprite's texture into the pictures of a flip-book, in rows from the upper left corner.";
  static Fields<render::SpriteSheet> fields() {
    using T = render::SpriteSheet;
    return {
        {"columns", &T::columns, "number of pictures in a row", "", between(1, render::kMostSheetPictures)},
        {"rows", &T::rows, "number of rows", "", between(1, render::kMostSheetPictures)},
        {"fps", &T::fps, "pictures per second of a particle's age", "1/s", kNotNegative},
        {"blend", &T::blend, "each picture fades to the next; false: they change at once"},
        {"loop", &T::loop, "the first picture follows the last; false: the last one stays"},
        {"random_start", &T::random_start, "particles start with different pictures"}};
  }
};
template <>
struct Table<LookMesh> {
  static constexpr const char* kName = "look_mesh";
  static constexpr const char* kHelp =
      "A shape or a model file that is drawn for each particle. It is scaled to fit into the particle's "
      "ball; its own size has no effect.";
  static Fields<LookMesh> fields() {
    using T = LookMesh;
    return {
        {"shape", &T::shape, "what is drawn; not a plane"},
        {"material", &T::material, "name of its material; empty: that of the model file, or a default one"},
        {"axis", &T::axis,
         "axis of `angle_deg` and `spin_deg_per_s`, in the mesh's axes; default: a random axis for each "
         "particle",
         "", kDirection},
        {"along_motion", &T::along_motion, "the mesh's +Y axis points along the velocity"}};
  }
};
template <>
struct Table<ParticleLook> {
  static constexpr const char* kName = "look";
  static constexpr const char* kHelp =
      "How particles are drawn. The style gives the default of each key. `sprite`: soft disc; `streak`: lit "
      "line along the motion, with a shadow; `drop`: the same without a shadow; `sphere`: lit ball; `smoke`: "
      "puff that is shadowed by the smoke in front of it; `fire`: glowing flame; `flake`: snow or dust; "
      "`spark`: glowing point with a tail; `mesh`: small object.";
  static Fields<ParticleLook> fields() {
    using T = ParticleLook;
    return {
        {"style", &T::style, "kind of picture drawn for each particle"},
        {"color", &T::color, "base colour; alpha is the opacity"},
        {"color_over_age", &T::color_over_age,
         "multiplies `color`; age 0 is the birth time, 1 the end of the lifespan"},
        {"temperature_over_age", &T::temperature_over_age,
         "multiplies both by the colour of a black body of this temperature and its brightness relative "
         "to the hottest key",
         "K", kTemperature},
        {"size_over_age", &T::size_over_age, "multiplies the drawn radius", "", kNotNegative},
        {"ramp", &T::ramp, "interpolation between the keys over age"},
        {"color_deviation", &T::color_deviation, "standard deviation of the brightness between particles", "",
         kFraction},
        {"channel_deviation", &T::channel_deviation,
         "standard deviations of red, green, blue and opacity between particles", "", kNotNegative},
        {"additive", &T::additive, "adds light instead of covering; default: true for sparks and fire"},
        {"lit", &T::lit,
         "lit by sun and sky; if false, the colour is emitted light; default: true except for sparks and "
         "fire"},
        {"casts_shadow", &T::casts_shadow,
         "casts a shadow; default: true for sprites, streaks, spheres and smoke"},
        {"softness", &T::softness, "width of the soft rim as a fraction of the radius; default: 0.5", "",
         kFraction},
        {"stretch", &T::stretch,
         "a streak is as long as its particle's motion in this time; smoke, fire, flakes and sprites are "
         "lengthened by the same distance; default: 1/60, for sparks 1/40, for fire 0.1, for smoke and "
         "sprites "
         "0",
         "s", kNotNegative},
        {"taper", &T::taper, "fraction by which a streak fades towards its tail; default: 0, for sparks 1",
         "", kFraction},
        {"metallic", &T::metallic, "for spheres: 0 is a dielectric, 1 a metal; default: 0", "", kFraction},
        {"roughness", &T::roughness, "for spheres: 0 is a mirror, 1 is dull; default: 0.3", "", kFraction},
        {"texture", &T::texture,
         "image file that is drawn for each sprite, times its colour; empty: a soft disc. The longer side is "
         "the particle's diameter"},
        {"sheet", &T::sheet, "the pictures of a flip-book in the texture; default: it is one picture"},
        {"mesh", &T::mesh, "the object that the style `mesh` draws, with its own material"},
        {"angle_deg", &T::angle_deg,
         "rotation of a new particle, counter-clockwise as seen by the camera, or about the axis of the "
         "mesh; "
         "for sprites with a texture, flakes and meshes",
         "degrees"},
        {"spin_deg_per_s", &T::spin_deg_per_s, "speed of this rotation", "degrees/s"},
    };
  }
};
template <>
struct Table<sim::ParticleSystemDef> {
  static Fields<sim::ParticleSystemDef> fields() {
    using T = sim::ParticleSystemDef;
    return {
        {"linear_drag", &T::linear_drag, "drag force per speed relative to the air", "kg/s", kNotNegative},
        {"gravity", &T::gravity, "the world's gravity acts on the particles"},
        {"force", &T::force, "constant force on each particle", "N"},
        {"collides", &T::collides, "particles collide with bodies"},
        {"internal", &T::internal, "particles of this system collide with each other"},
        {"external", &T::external, "particles collide with those of other systems that also have `external`"},
        {"rotates", &T::rotates,
         "contacts turn the particles as solid balls, so that they roll and friction acts at their surface; "
         "otherwise they slide without turning. Objects of the style `mesh` show the rotation. Sand and "
         "other "
         "granular materials need it to flow and heap"},
        {"dies_on_hit", &T::dies_on_hit, "a particle is removed at its first collision"},
        {"integrator", &T::integrator,
         "integration method of particles without springs; `leapfrog` is of second order at the cost of one "
         "force evaluation, and is stable for any drag"},
    };
  }
};

// --- Groups ---

template <>
struct Table<ParticlePlace> {
  static constexpr const char* kName = "particle";
  static constexpr const char* kHelp = "One particle of a group.";
  static Fields<ParticlePlace> fields() {
    return {{"position", &ParticlePlace::position, "position at time 0", "m"},
            {"velocity", &ParticlePlace::velocity, "velocity at time 0", "m/s"},
            {"color", &ParticlePlace::color, "colour, instead of that of the look"}};
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
         "PLY or OBJ file whose points become particles after those of `places`, with the colours of the "
         "points; "
         "empty: none"},
        {"scale", &T::scale,
         "scale factor of the file's points; `auto`: from the file's likely unit to metres (docs/models.md)",
         "", kScale},
        {"fit", &T::fit,
         "edges of a box; the points get the largest size with which they fit, before `scale`", "m",
         kPositive},
        {"position", &T::position, "position of the file's origin", "m"},
        {"orientation", &T::orientation, "orientation of the file's axes"},
        {"max_points", &T::max_points, "greatest number of points; a file with more is thinned out evenly",
         "", between(1, 2e7)},
        {"radius", &T::radius, "radius of each particle", "m", kPositive},
        {"mass", &T::mass, "mass of each particle", "kg", kPositive},
        {"restitution", &T::restitution,
         "coefficient of restitution; of particle and body the larger value is used", "", kFraction},
        {"friction", &T::friction,
         "coefficient of dynamic friction; of particle and body the geometric mean is used", "",
         kNotNegative},
        {"charge", &T::charge, "electric charge of each particle", "C"},
        {"appear_at", &T::appear_at, "time at which the particles appear", "s", kNotNegative},
        {"remove_at", &T::remove_at,
         "time at which the particles are removed; must be later than `appear_at`", "s", kPositive},
        {"look", &T::look, "how the particles are drawn"},
    }
        .with(&T::behaviour);
  }
};

// --- Sources ---

template <>
struct Table<Split> {
  static constexpr const char* kName = "split";
  static constexpr const char* kHelp =
      "Particles that release children of the same kind, which can split again. Percentages refer to the "
      "parent's value at the time of the split.";
  static Fields<Split> fields() {
    using T = Split;
    return {
        {"enabled", &T::enabled, "whether particles split"},
        {"count", &T::count, "number of children of one split, rounded", "", between(0, 1000)},
        {"age", &T::age, "age of a particle at its first split", "s", kPositive},
        {"delay", &T::delay, "time to its next split", "s", kPositive},
        {"delay_steps", &T::delay_steps,
         "instead of `delay`: time to its next split as a number of sub-steps of `world.step`; 0: `delay` "
         "applies",
         "", between(0, 1e6)},
        {"depth", &T::depth,
         "largest number of splits in the history of a particle, including those of its ancestors", "",
         between(1, 16)},
        {"velocity_percent", &T::velocity_percent,
         "fraction of the parent's velocity that a child starts with", "%"},
        {"spread_deg", &T::spread_deg, "angle between a child's direction and the parent's", "degrees",
         kAngles},
        {"radius_percent", &T::radius_percent, "radius of a child, relative to the parent's", "%", kPositive},
        {"mass_percent", &T::mass_percent,
         "mass of a child, relative to the parent's; 0: the same density as the parent", "%", kNotNegative},
        {"lifespan_percent", &T::lifespan_percent, "lifespan of a child, relative to the parent's", "%",
         kPositive}};
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
        {"density", &T::density, "density; determines the mass unless `mass` is given", "kg/m^3", kPositive},
        {"mass", &T::mass, "mass of a particle; 0: computed from density and radius", "kg", kNotNegative},
        {"lifespan", &T::lifespan, "age at which a particle is removed", "s", kPositive},
        {"restitution", &T::restitution,
         "coefficient of restitution; of particle and body the larger value is used", "", kFraction},
        {"friction", &T::friction,
         "coefficient of dynamic friction; of particle and body the geometric mean is used", "",
         kNotNegative},
        {"charge", &T::charge, "electric charge of a particle", "C"},
        {"max_alive", &T::max_alive, "largest number of particles that exist at once", "", between(1, 2e7)},
        {"look", &T::look, "how particles are drawn"},
    }
        .with(&T::behaviour);
  }
};
/// Child particles of any source.
template <class T>
Fields<T> with_offspring(Fields<T> fields) {
  return std::move(fields).then({
      {"split", &T::split, "its particles release children of the same kind"},
      {"trails", &T::trails, "other particles that each particle leaves along its path"},
      {"on_age", &T::on_age, "other particles that are created when a particle reaches an age"},
      {"on_collision", &T::on_collision, "other particles that are created when a particle collides"},
      {"on_death", &T::on_death, "other particles that are created when a particle reaches its lifespan"},
  });
}
template <>
struct Table<TrailSource> {
  static constexpr const char* kName = "trail";
  static constexpr const char* kHelp = "Particles that each parent leaves along its path, evenly in time.";
  static Fields<TrailSource> fields() {
    using T = TrailSource;
    return with_offspring(Fields<T>{
        {"name", &T::name,
         "name, which follows the parent's name and a slash; default: trails_N, where N is the index in the "
         "list"},
        {"rate", &T::rate, "particles released per second by each parent", "1/s", between(0, 1e5)},
        {"start_age", &T::start_age, "age of the parent at which the trail starts", "s", kNotNegative},
        {"end_age", &T::end_age, "age of the parent at which the trail ends", "s", kNotNegative},
        {"velocity_percent", &T::velocity_percent,
         "fraction of the parent's velocity that a new particle starts with; `speed` is added backwards",
         "%"},
    }
                              .with_base<ParticleSource>());
  }
};
template <>
struct Names<effects::Axis> {
  static constexpr std::array kNames = {"normal", "velocity"};
};
/// Keys of all events.
template <class T>
Fields<T> event_fields() {
  return with_offspring(Fields<T>{
      {"probability", &T::probability, "probability that an event creates particles", "", kFraction},
      {"min_speed", &T::min_speed,
       "least speed of the parent after the event; slower parents create no particles", "m/s", kNotNegative},
      {"count", &T::count, "number of particles for each event, rounded", "", kCounts},
      {"axis", &T::axis,
       "axis of the release: `normal` is the normal of the surface that was hit (without a collision, as "
       "`velocity`); `velocity` is the parent's velocity"},
      {"velocity_percent", &T::velocity_percent,
       "fraction of the parent's velocity that a new particle starts with; `speed` is added along the axis",
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
                      "name, which follows the parent's name and a slash; empty: on_collision_N or "
                      "on_death_N, where N is the index in the list"}}
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
                      "name, which follows the parent's name and a slash; default: on_age_N, where N is the "
                      "index in the list"},
                     {"age", &T::age, "age of the parent", "s", kNotNegative}}
        .then(event_fields<T>());
  }
};

// --- Emitters ---

template <>
struct Table<PlaneSurface> {
  static constexpr const char* kName = "plane_surface";
  static constexpr const char* kHelp = "A rectangle that releases particles along its normal.";
  static Fields<PlaneSurface> fields() {
    return {{"position", &PlaneSurface::position, "centre of the rectangle, in the emitter's frame", "m"},
            {"direction", &PlaneSurface::direction, "normal of the rectangle, in the emitter's frame", "",
             kDirection},
            {"turn_deg", &PlaneSurface::turn_deg, "rotation of the rectangle about its normal", "degrees"},
            {"size", &PlaneSurface::size, "lengths of the two edges", "m", kPositive}};
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
        {"file", &MeshSurface::file, "model file", kRequired},
        {"scale", &MeshSurface::scale,
         "scale factor of the model; `auto`: from the file's likely unit to metres (docs/models.md; "
         "`offstage info FILE` "
         "shows it)",
         "", kPositive},
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
      "top or "
      "bottom of a cylinder, cone or frustum. Without a body, a face of a cuboid.";
  static Fields<FaceSurface> fields() {
    using T = FaceSurface;
    return {{"face", &T::face,
             "top and bottom are at +y and -y, right and left at +x and -x, front and back at +z and -z"},
            {"position", &T::position, "centre of the cuboid, without a body", "m"},
            {"size", &T::size, "edges of the cuboid, without a body", "m", kPositive}};
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
        {"body", &T::body, "name of the body it moves with; empty: fixed in the world"},
        {"surface", &T::surface, "surface that particles are released from"},
        {"direction", &T::direction,
         "direction of release, in the frame of the body or in the world; zero: the normal of the surface"},
        {"inherit_velocity", &T::inherit_velocity,
         "fraction of the velocity of the body's point that a new particle gets, in addition to its own", "",
         kNotNegative},
        {"recoil", &T::recoil,
         "each new particle pushes the body back with its momentum relative to the body; dynamic bodies "
         "only"},
        {"overlap", &T::overlap,
         "new particles may overlap and never wait for space; for particles that do not collide with each "
         "other"},
        {"rate", &T::rate, "number of particles released one by one per second", "1/s", between(0, 1e9)},
        {"rate_per_metre", &T::rate_per_metre,
         "number of particles released evenly along each metre of the path of the body, in addition to the "
         "others; needs a "
         "`body`",
         "1/m", between(0, 1e9)},
        {"count", &T::count, "number of particles released together in every `interval`, rounded", "",
         kCounts},
        {"interval", &T::interval, "time between releases of `count`", "s", kPositive},
        {"bursts", &T::bursts, "many particles at given times"},
        {"start", &T::start, "time at which `rate` and `count` start", "s", kNotNegative},
        {"end", &T::end, "time at which all releases end; existing particles stay until their lifespan ends",
         "s", kNotNegative},
        {"windows", &T::windows, "periods in which `rate` and `count` release; empty: always"},
        {"prewarm", &T::prewarm,
         "how long before `start` the emitter has been running. Until time 0, particles move and collide "
         "while dynamic bodies, cloths and particle groups stand still, kinematic bodies follow their keys, "
         "and forces have their values of time 0",
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
      "All emitters and forces of a preset, with some of their keys replaced. `offstage presets` lists the "
      "presets.";
  static Fields<Effect> fields() {
    using T = Effect;
    return {{"preset", &T::preset, "name of the preset", kRequired},
            {"name", &T::name,
             "prefix of the names of its emitters and forces, followed by a slash; empty: the preset's name"},
            {"position", &T::position, "position of the preset's origin, in the world or in the body's frame",
             "m"},
            {"body", &T::body, "name of the body that its emitters move with; empty: none"},
            {"start", &T::start, "time added to all times of the preset", "s", kNotNegative},
            {"overrides", &T::overrides, "for each emitter or force, by name, the keys to replace"}};
  }
};

}  // namespace offstage::producer
