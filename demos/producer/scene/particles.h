#pragma once
/// The particles of a scene: looks, behaviour, groups, emitters, and child particles. See scene.h.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "effects/color.h"
#include "effects/emitter_def.h"
#include "effects/split.h"
#include "effects/sub_emitter.h"
#include "effects/trail.h"
#include "producer/scene/values.h"
#include "render/stage.h"
#include "sim/particles/particles.h"

namespace offstage::producer {

enum class LookStyle { sprite, streak, sphere, smoke, fire, flake, drop, spark, mesh };

/// A mesh that is drawn for each particle. It is scaled so that it just fits into a sphere with the
/// particle's radius.
struct LookMesh {
  Shape shape = sim::Box{};
  /// Name of the material; empty: the default material, or the material of the model file.
  std::string material;
  std::optional<Vec3> axis;   ///< axis of rotation; default: a random axis for each particle
  bool along_motion = false;  ///< whether the mesh's +Y axis points along the velocity
};

/// Look of particles. The style gives the values that are not set; see points_def().
struct ParticleLook {
  LookStyle style = LookStyle::sprite;
  Color color;
  std::vector<std::pair<Real, Color>> color_over_age;  ///< [age 0..1, colour]; multiplies `color`
  /// [age 0..1, K]; multiplies `color` and `color_over_age`.
  std::vector<std::pair<Real, Real>> temperature_over_age;
  std::vector<std::pair<Real, Real>> size_over_age;  ///< [age 0..1, factor]
  effects::RampKind ramp = effects::RampKind::linear;
  Real color_deviation = 0;  ///< deviation of the brightness between particles
  /// Deviations of red, green, blue and alpha between particles.
  Eigen::Vector4d channel_deviation = Eigen::Vector4d::Zero();
  std::optional<bool> additive, lit, casts_shadow;
  std::optional<Real> softness, stretch, taper, metallic, roughness;
  std::string texture;  ///< picture of sprites; empty: a soft disc
  std::optional<render::SpriteSheet> sheet;
  std::optional<LookMesh> mesh;  ///< object that the style `mesh` draws, which this style requires
  Varying angle_deg = 0.0;       ///< angle of a particle at its birth time [degrees]
  Varying spin_deg_per_s = 0.0;

  /// Returns whether a rotation of a particle changes its appearance.
  bool turns() const;
};

/// Converts a look for the stage. Values that are not set get the default of the style.
render::PointsDef points_def(const ParticleLook& look);

/// Initial state of one particle of a group.
struct ParticlePlace {
  Vec3 position = Vec3::Zero();
  Vec3 velocity = Vec3::Zero();
  std::optional<Color> color;  ///< colour of the particle; default: the colour of the look
};

/// Particles placed one by one, or as the points of a file.
struct ParticleGroup {
  Where where;
  std::string name;
  /// Particles that are listed one by one. Loading appends the particles of `file` and of `fill`.
  std::vector<ParticlePlace> places;
  std::optional<Fill> fill;  ///< volume that is filled with further particles
  std::string file;          ///< PLY or OBJ file; empty: none
  ModelScale scale;
  std::optional<Vec3> fit;       ///< see MeshFile::fit
  Vec3 position = Vec3::Zero();  ///< position of the file's origin
  Quat orientation = Quat::Identity();
  int64_t max_points = 1'000'000;
  Real radius = 0.05;
  Real mass = 1;
  Real restitution = 0.5;
  Real friction = 0.5;
  Real charge = 0;
  Real appear_at = 0;
  Real remove_at = 1e30;
  sim::ParticleSystemDef
      behaviour;  ///< in the file, the keys of the behaviour are keys of the group; see system_def()
  ParticleLook look;
};

/// Splits each particle into several of the same kind when it reaches a given age. Percentages refer to the
/// parent's values.
struct Split : effects::SplitDef {
  int delay_steps = 0;  ///< delay as a number of steps of length world.step; replaces `delay`
};

struct TrailSource;
struct EventSource;
struct AgeSource;

/// The keys that all sources of particles have: the properties of the new particles, and the sources that
/// emit their child particles. Each source has its own particle system.
struct ParticleSource : effects::NewParticles {
  Where where;
  std::string name;
  sim::ParticleSystemDef
      behaviour;  ///< in the file, the keys of the behaviour are keys of the source; see system_def()
  ParticleLook look;
  std::optional<Split> split;
  std::vector<TrailSource> trails;
  std::vector<AgeSource> on_age;
  std::vector<EventSource> on_collision, on_death;
};

/// Releases child particles along the path of each parent particle.
struct TrailSource : ParticleSource, effects::TrailRelease {
  TrailSource();
};

/// Releases child particles at an event of a parent particle, such as its death.
struct EventSource : ParticleSource, effects::EventRelease {
  EventSource();
};
/// Releases child particles when a parent particle reaches an age.
struct AgeSource : EventSource {
  Real age = 1;  ///< [s]
};

/// A rectangle from which particles are released along `direction`.
struct PlaneSurface {
  Vec3 position = Vec3::Zero();
  Vec3 direction = Vec3::UnitY();
  Real turn_deg = 0;  ///< rotation of the rectangle about its direction
  Eigen::Vector2d size = {0.1, 0.1};

  /// Returns the rotation about +Y by `turn_deg`, followed by the smallest rotation from +Y to `direction`.
  Quat orientation() const;
};
struct SphereSurface {
  Vec3 position = Vec3::Zero();
  Real radius = 0.1;
};
struct DiscSurface {
  Vec3 position = Vec3::Zero();
  Vec3 direction = Vec3::UnitY();
  Real radius = 0.1;
};
struct MeshSurface {
  std::string file;
  ModelScale scale;
  Vec3 position = Vec3::Zero();
  Quat orientation = Quat::Identity();
};
enum class Face { top, bottom, left, right, front, back };
/// A face of the emitter's body. The body is a box, or a round shape with a flat top and bottom. An emitter
/// without a body has its own box, given here.
struct FaceSurface {
  Face face = Face::top;
  Vec3 position = Vec3::Zero();  ///< centre of the emitter's own box
  Vec3 size = Vec3::Ones();      ///< size of the emitter's own box
};
using EmitterSurface = std::variant<PlaneSurface, SphereSurface, DiscSurface, MeshSurface, FaceSurface>;
/// Returns the face of a body's shape. If `body` is null, returns the face of the surface's own box. Returns
/// nothing if the shape has no such face.
std::optional<EmitterSurface> face_of(const FaceSurface& surface, const struct Body* body);

/// Returns the position of a surface of any kind.
Vec3& position_of(EmitterSurface& surface);
const Vec3& position_of(const EmitterSurface& surface);

struct Emitter : ParticleSource, effects::EmitterRelease {
  std::string preset;  ///< name of a preset; a loaded emitter already contains its values
  std::string body;    ///< name of the body that carries the emitter; empty: fixed in the world
  EmitterSurface surface = PlaneSurface{};
  Placement placement;
};

/// Describes how a source emits particles: along the path of a parent (`trail`) or at an event of a parent
/// (`event`). If both are null, the source is an emitter.
struct Emission {
  const TrailSource* trail = nullptr;
  const EventSource* event = nullptr;
  effects::Trigger trigger = effects::Trigger::collision;
  Real age = 0;  ///< age at which the trigger `age` emits [s]
};

namespace detail {

template <class List, class F>
void visit_list(const std::string& parent, const char* kind, const List& list, F&& visit) {
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string own = list[i].name.empty() ? kind + ("_" + std::to_string(i)) : list[i].name;
    visit(list[i], parent + "/" + own);
  }
}

template <class F>
void visit_tree(const ParticleSource& source, const ParticleSource* parent, const std::string& name,
                const Emission& emission, F& visit) {
  using effects::Trigger;
  visit(source, parent, name, emission);
  visit_list(name, "trails", source.trails, [&](const TrailSource& child, const std::string& full) {
    visit_tree(child, &source, full, Emission{.trail = &child}, visit);
  });
  visit_list(name, "on_age", source.on_age, [&](const AgeSource& child, const std::string& full) {
    visit_tree(child, &source, full, Emission{.event = &child, .trigger = Trigger::age, .age = child.age},
               visit);
  });
  visit_list(
      name, "on_collision", source.on_collision, [&](const EventSource& child, const std::string& full) {
        visit_tree(child, &source, full, Emission{.event = &child, .trigger = Trigger::collision}, visit);
      });
  visit_list(name, "on_death", source.on_death, [&](const EventSource& child, const std::string& full) {
    visit_tree(child, &source, full, Emission{.event = &child, .trigger = Trigger::death}, visit);
  });
}

}  // namespace detail

/// Calls visit(source, parent, name, emission) for an emitter and all sources of its child particles, parents
/// before children. The name of a child is "PARENT/CHILD". Snapshots have their point sets in the same order.
template <class F>
void for_each_source(const Emitter& emitter, F&& visit) {
  detail::visit_tree(emitter, nullptr, emitter.name, {}, visit);
}

}  // namespace offstage::producer
