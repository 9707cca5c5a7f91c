#pragma once
/// The scene as plain structs, as a file describes it and before anything is built. Every field here is a key
/// of the scene format with the same name; scene_table.cpp gives each its unit, range and line of help, once,
/// for the loader, the schema and the reference. SI units; angles in degrees where a name says so.

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "producer/base/error.h"
#include "producer/scene/cloth.h"
#include "producer/scene/effects.h"
#include "producer/scene/forces.h"
#include "producer/scene/joint.h"
#include "producer/scene/particles.h"
#include "producer/scene/values.h"
#include "render/channels.h"
#include "render/frame_rate.h"
#include "render/model.h"
#include "render/stage.h"
#include "render/tone_map.h"
#include "sim/contact/collision.h"
#include "sim/core/types.h"
#include "sim/dynamics/integrator.h"
#include "sim/dynamics/keyframes.h"
#include "sim/geometry/shape.h"
#include "sim/world.h"

namespace offstage::producer {

struct WorldSettings {
  Vec3 gravity = {0, -9.81, 0};
  Vec3 wind = Vec3::Zero();
  Real step = 1.0 / 240;
  sim::IntegratorKind integrator = sim::IntegratorKind::rk4;
  Real integration_error = 1e-6;  ///< per step, of the adaptive integrators
  sim::SolverKind solver = sim::SolverKind::automatic;
  sim::ImpactLaw impact = sim::ImpactLaw::simultaneous;
  Real collision_speed = 0.05;  ///< bodies that meet slower than this do not bounce
  bool sleep = true;            ///< groups of bodies at rest are left alone
  Real bounds = 1000;           ///< half the edge of the cube everything must stay in
  uint64_t seed = 1;
};

/// What the look of a cloth has besides.
struct FabricLook {
  render::Weave weave = render::Weave::plain;
  Real thread = 0.001;
  Real relief = 0.5;
  Real sheen = 0.2;
  Color sheen_color;
  Real translucency = 0.15;
  std::optional<Color> back_color;  ///< default: the front's
};

/// Look and contact behaviour in one.
struct Material {
  Where where;
  std::string name;
  Color color{{0.8f, 0.8f, 0.8f, 1}};
  Real metallic = 0;
  Real roughness = 0.5;
  Color emission{{0, 0, 0, 1}};
  Real emission_strength = 1;
  Real transmission = 0;  ///< share of the light under the surface that goes through, as in glass
  Real refraction = 1.5;  ///< index of
  render::Pattern pattern = render::Pattern::none;
  Color pattern_color{{0.4f, 0.4f, 0.4f, 1}};
  Real pattern_scale = 1;
  std::string texture;  ///< image file
  bool two_sided = false;
  std::optional<FabricLook> fabric;  ///< of cloths; default: that of what the cloth is made of
  Real restitution = 0.5;
  Real friction = 0.5;                  ///< of what slides
  std::optional<Real> static_friction;  ///< of what does not; default: `friction`
  std::optional<Real> cross_friction;   ///< of sliding across a body's friction_axis; default: `friction`
};

/// What two materials do to each other, in place of what would follow from each.
struct ContactRule {
  Where where;
  std::array<std::string, 2> materials;  ///< names, in any order
  std::optional<Real> restitution, friction, static_friction;
};

using Shape =
    std::variant<sim::Sphere, sim::Box, sim::Capsule, sim::Cylinder, sim::Cone, sim::Plane, MeshFile>;

/// A model file drawn instead of a body's shape.
struct ModelLook {
  std::string file;
  Real scale = 1;
  Vec3 position = Vec3::Zero();  ///< in the body's frame
  Quat orientation = Quat::Identity();
};

struct BodyKey {
  Real time = 0;
  std::optional<Vec3> position;                     ///< default: the body's
  std::optional<Quat> orientation;                  ///< default: the body's
  std::optional<sim::Interpolation> interpolation;  ///< to the next key; default: the body's
};

struct Body {
  Where where;
  std::string name;
  sim::MotionType motion = sim::MotionType::dynamic;  ///< "static", "kinematic", "dynamic"
  Shape shape = sim::Box{};
  std::optional<ModelLook> model;
  std::string material;  ///< name; empty: the default material, or the model file's own
  Vec3 position = Vec3::Zero();
  Quat orientation = Quat::Identity();
  Vec3 velocity = Vec3::Zero();
  Vec3 angular_velocity = Vec3::Zero();
  Real density = 1000;
  Real mass = 0;
  Real linear_drag = 0;
  Real angular_drag = 0;
  Vec3 friction_axis = Vec3::Zero();     ///< the surface's grain, in the body's frame
  Vec3 surface_velocity = Vec3::Zero();  ///< of the surface against the body, in its frame
  bool collides = true;
  bool visible = true;
  bool casts_shadow = true;
  std::vector<BodyKey> keyframes;
  sim::Interpolation interpolation = sim::Interpolation::monotone;
  bool loop = false;
  Vec3 spin = Vec3::Zero();
  Placement placement;  ///< its three keys stand directly in the body
};

/// One end of a spring: a point of the world, of a body (in its frame), or one particle of a group.
struct SpringEnd {
  std::string body;
  std::string particles;
  int index = 0;  ///< of the particle in its group
  Vec3 position = Vec3::Zero();
};

struct Spring {
  Where where;
  std::string name;
  SpringEnd a, b;
  Real stiffness = 100;
  Real damping = 0;
  Real rest_length = -1;
  bool visible = true;
  Real radius = 0.01;  ///< of the drawn rod
  std::string material;
};

/// How the lines of an overlay are drawn.
struct LineLook {
  Real width = 0.003;  ///< share of the picture's height
  Real hidden = 0.3;   ///< opacity of what is behind something
};

enum class BoundingVolumeKind { aabb, obb, sphere };

/// The bounding tree of a mesh body, one level of it at a time.
struct TreeOverlay : LineLook {
  Where where;
  std::string body;
  BoundingVolumeKind volume = BoundingVolumeKind::obb;
  Varying level = 3.0;  ///< 0: the root; between two levels one fades into the other
};
/// The convex parts of a mesh body in colours, instead of the body.
struct PartsOverlay {
  Where where;
  std::string body;
  Varying explode = 0.0;  ///< how much farther from the centre the parts are drawn, as a share
};
/// The closest points of two bodies, or how deep one is in the other.
struct ClosestOverlay : LineLook {
  Where where;
  std::string a, b;
  Color color{{1, 0.75f, 0.1f, 1}};
  Color penetrating{{1, 0.08f, 0.05f, 1}};
};
/// Where bodies touch, and which way they push each other: the contacts of the simulation, and by geometry
/// those of bodies that no force moves, which it has none of.
struct ContactsOverlay : LineLook {
  Where where;
  std::string a, b;      ///< both empty: every pair
  Real margin = 0.01;    ///< by geometry, how near counts as touching
  Real size = 0.06;      ///< radius of the ring around a point; its arrow is four times as long
  Real force_scale = 0;  ///< length of an arrow per newton, which is then the contact's force
  Color color{{1, 0.75f, 0.1f, 1}};
};
/// How fast bodies move, as arrows from their centres of mass.
struct VelocitiesOverlay : LineLook {
  Where where;
  std::string body;        ///< empty: all that move
  Real scale = 0.2;        ///< length per m/s
  Real angular_scale = 0;  ///< of a second arrow along the axis of rotation, per rad/s
  Color color{{0.2f, 0.8f, 1, 1}};
  Color angular_color{{1, 0.3f, 0.8f, 1}};
};
/// Which bodies touch each other directly or through others: a box around each, in a colour of their group.
struct IslandsOverlay : LineLook {
  Where where;
  Real asleep = 0.25;  ///< brightness of bodies that are asleep
};
/// Joints: where they are, the axes that they leave free, and what they bear.
struct JointsOverlay : LineLook {
  Where where;
  std::string joint;     ///< empty: all
  Real size = 0.08;      ///< radius of the ring around an axis, which is four times as long
  Real force_scale = 0;  ///< length of an arrow per newton on a; 0: none
  Color color{{1, 0.45f, 0.1f, 1}};
  Color force_color{{0.2f, 0.8f, 1, 1}};
};
/// The threads of cloths, in colours of their strain: blue at rest, red where they are stretched.
struct ClothOverlay : LineLook {
  Where where;
  std::string cloth;   ///< empty: all
  Real strain = 0.05;  ///< at which a thread is red
};
/// Where the centres of mass of bodies have been.
struct TrailsOverlay : LineLook {
  Where where;
  std::string body;            ///< empty: all dynamic ones
  Real duration = 1;           ///< how far back
  std::optional<Color> color;  ///< default: a colour of its own for each
};
enum class TextPlace { top_left, top_right, bottom_left, bottom_right, center };
/// Words on the picture.
struct TextOverlay {
  Where where;
  std::string text = "{time}";
  TextPlace place = TextPlace::bottom_left;
  Real size = 0.035;  ///< height of a line, as a share of the picture's
  Color color{{1, 1, 1, 1}};
  Real from = 0;  ///< when it is shown
  std::optional<Real> until;
};
/// What is drawn over the picture to show how the simulation sees it.
using Overlay = std::variant<TreeOverlay, PartsOverlay, ClosestOverlay, ContactsOverlay, VelocitiesOverlay,
                             IslandsOverlay, JointsOverlay, ClothOverlay, TrailsOverlay, TextOverlay>;

/// What all cameras have.
struct Lens {
  Real fov_deg = 40;
  std::optional<Real> focal_mm;  ///< in place of fov_deg
  Real aperture = 0;
  Real focus = 0;
  std::string focus_on;          ///< body, in place of `focus`
  std::string look_at;           ///< body, in place of the target
  std::vector<std::string> fit;  ///< bodies that are to fill the picture
};
struct StaticCamera : Lens {
  Vec3 eye = {4, 2.5, 6};
  Vec3 target = Vec3::Zero();
};
struct CameraKey {
  Real time = 0;
  Vec3 eye = {4, 2.5, 6};
  Vec3 target = Vec3::Zero();
  std::optional<Real> fov_deg, focus;               ///< default: the camera's
  std::optional<sim::Interpolation> interpolation;  ///< to the next key; default: the camera's
};
struct KeyframedCamera : Lens {
  std::vector<CameraKey> keyframes;
  sim::Interpolation interpolation = sim::Interpolation::monotone;
};
struct OrbitCamera : Lens {
  Vec3 target = Vec3::Zero();
  Real radius = 8;
  Real height = 3;     ///< of the eye above the target
  Real start_deg = 0;  ///< from +Z towards +X
  Real turn_deg_per_s = 20;
};
struct FollowCamera : Lens {
  std::string body;
  Vec3 offset = {0, 2, 6};  ///< of the eye from the body, world axes
  Vec3 look_offset = Vec3::Zero();
};
using Camera = std::variant<StaticCamera, KeyframedCamera, OrbitCamera, FollowCamera>;

struct SunLight {
  Vec3 direction = {0.45, 0.75, 0.5};  ///< towards the sun
  Color color{{1, 0.95f, 0.87f, 1}};
  Real intensity = 3;
  Real size_deg = 1.5;
  bool shadows = true;
};
/// What lights near the scene have.
struct LampBase {
  Where where;
  std::string body;  ///< that carries it; empty: none
  Vec3 position = {0, 3, 0};
  Color color{{1, 0.85f, 0.65f, 1}};
  Varying intensity = 10.0;  ///< brightness of a white surface 1 m away that faces it
  bool shadows = true;
};
struct PointLight : LampBase {
  Real radius = 0.1;
};
struct SpotLight : LampBase {
  Vec3 target = Vec3::Zero();
  Real angle_deg = 40;
  Real softness = 0.3;
  Real radius = 0.05;
};
struct AreaLight : LampBase {
  Vec3 target = Vec3::Zero();
  Eigen::Vector2d size = {1, 1};
};
using Light = std::variant<SunLight, PointLight, SpotLight, AreaLight>;

enum class Background { sky, transparent };

struct EnvironmentSettings {
  Color zenith{{0.2f, 0.42f, 0.88f, 1}};
  Color horizon{{0.95f, 1.05f, 1.15f, 1}};
  std::optional<Color> ground;  ///< default: what the ground plane sends back
  Real intensity = 1;
  Real fog = 0;
  Real clouds = 0;
  std::optional<Real> occlusion;  ///< how far away things hide the sky; default: by the camera's distance
  Background background = Background::sky;
};

/// Sub-frames per frame: draft 1 and an edge filter, preview 4, final 16. Never changes the physics.
enum class Quality { draft, preview, final };
int subframes(Quality quality);

/// `automatic`: each frame is exposed so that its mean brightness is that of the same grey.
enum class Metering { fixed, automatic };

struct RenderSettings {
  Eigen::Vector2i size = {1280, 720};
  Quality quality = Quality::preview;
  Real shutter = 0.5;  ///< share of the frame time the shutter is open
  Varying exposure = 1.0;
  Metering metering = Metering::fixed;
  Real bloom = 0.12;  ///< share of the light beyond white that spreads as glow
  render::ToneCurve tone_curve = render::ToneCurve::filmic;
  int shadow_map = 2048;
};

struct OutputSettings {
  render::FrameRate fps;  ///< frames per second
  Real duration = 5;
  Real start =
      0;  ///< time of frame 1: earlier times are simulated but not shown (a fountain already running)
  std::vector<render::Channel> channels;  ///< numbers for each pixel, in files beside the frames or the video
  render::ChannelFormat channel_format = render::ChannelFormat::exr;

  /// The time that frame k shows [s], k from 1.
  Real time_of(int frame) const { return start + fps.seconds(frame - 1); }
};

struct Scene {
  int version = 1;
  std::string name;  ///< default: the file's name
  std::string description;
  WorldSettings world;
  std::vector<Material> materials;
  std::vector<ContactRule> contacts;
  std::vector<Body> bodies;
  std::vector<ParticleGroup> particles;
  std::vector<Emitter> emitters;
  std::vector<Effect> effects;  ///< once a scene is loaded, its emitters and forces are among the others
  std::vector<Spring> springs;
  std::vector<Joint> joints;
  std::vector<ArticulationTemplate> articulations;  ///< become bodies and joints with the copies
  std::vector<Cloth> cloths;
  std::vector<Force> forces;
  std::vector<Overlay> overlays;
  Camera camera = StaticCamera{};
  std::vector<Light> lights = {SunLight{}};
  EnvironmentSettings environment;
  RenderSettings render;
  OutputSettings output;

  /// Frames are numbered from 1; frame k shows the time start + (k - 1) / fps.
  int frame_count() const;
};

}  // namespace offstage::producer
