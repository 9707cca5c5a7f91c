#pragma once
/// The scene as plain structs, with the values of its file, before anything is built. Some structs contain a
/// definition of the simulation or the effects library, whose fields are then keys of the scene. The tables
/// in format/ define the unit, range and help text of each key, for the loader, the schema and the reference.
/// Units are SI units; angles are in degrees if a name ends in `_deg`.

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

/// The scene key `world`. In a scene, `bounds` is always a cube around the origin.
struct WorldSettings : sim::WorldDef {
  uint64_t seed = 1;
};

/// Additional properties of the look of a cloth.
struct FabricLook {
  render::Weave weave = render::Weave::plain;
  Real thread = 0.001;
  Real relief = 0.5;
  Real sheen = 0.2;
  Color sheen_color;
  Real translucency = 0.15;
  std::optional<Color> back_color;  ///< colour of the back; default: the colour of the front
};

/// Mapping of a texture. `surface` uses the texture coordinates of the mesh; `triplanar` projects the texture
/// along the three axes of the body.
enum class TextureProjection { surface, triplanar };

/// Look and contact properties of a surface.
struct Material {
  Where where;
  std::string name;
  Color color{{0.8f, 0.8f, 0.8f, 1}};
  Real metallic = 0;
  Real roughness = 0.5;
  Color emission{{0, 0, 0, 1}};
  Real emission_strength = 1;
  Real transmission = 0;  ///< fraction of the light that enters the surface and passes through, as in glass
  Real refraction = 1.5;  ///< index of refraction
  render::Pattern pattern = render::Pattern::none;
  Color pattern_color{{0.4f, 0.4f, 0.4f, 1}};
  Real pattern_scale = 1;
  std::string texture;  ///< image file
  TextureProjection texture_projection = TextureProjection::surface;
  Real texture_scale = 1;
  Real texture_angle_deg = 0;
  bool two_sided = false;
  std::optional<FabricLook>
      fabric;  ///< look of the threads on cloths; default: the look of the cloth's fabric
  Real restitution = 0.5;
  Real friction = 0.5;                  ///< dynamic coefficient
  std::optional<Real> static_friction;  ///< static coefficient; default: `friction`
  std::optional<Real> cross_friction;   ///< coefficient across a body's friction_axis; default: `friction`
  /// Coefficients of rolling and spinning friction [m]; see sim::BodyDef.
  Real rolling_friction = 0, spinning_friction = 0;
};

/// Contact properties for a pair of materials. They replace the values that are otherwise combined from both
/// materials.
struct ContactRule : sim::ContactRule {
  Where where;
  std::array<std::string, 2> materials;  ///< names, in any order; they become `a` and `b`
};

/// A model file that is drawn instead of a body's shape.
struct ModelLook {
  std::string file;
  ModelScale scale = {};
  std::optional<Vec3> fit = {};  ///< see MeshFile::fit
  Vec3 position = Vec3::Zero();  ///< position of the model's origin, in the body's frame
  Quat orientation = Quat::Identity();
};

/// The animation that a body's model plays.
struct ModelAnimation {
  std::string clip;  ///< name of the clip, or its index from 0; empty: the first clip
  Real speed = 1;
  Real start = 0;  ///< time at which the animation starts; until then its first pose is held
  bool loop = true;
};

struct BodyKey {
  Real time = 0;
  std::optional<Vec3> position;     ///< position at this key; default: position of the body
  std::optional<Quat> orientation;  ///< orientation at this key; default: orientation of the body
  /// Interpolation to the next key; default: the interpolation of the body.
  std::optional<sim::Interpolation> interpolation;
};

struct Body {
  Where where;
  std::string name;
  sim::MotionType motion = sim::MotionType::dynamic;  ///< "static", "kinematic", "dynamic"
  Shape shape = sim::Box{};
  std::optional<ModelLook> model;
  std::optional<ModelAnimation> animation;
  /// Name of the material; empty: the default material, or the material of the model file.
  std::string material;
  Vec3 position = Vec3::Zero();
  Quat orientation = Quat::Identity();
  Vec3 velocity = Vec3::Zero();
  Vec3 angular_velocity = Vec3::Zero();
  Real density = 1000;
  Real mass = 0;
  std::optional<Vec3> centre;   ///< centre of mass, in the body's frame; default: computed from the shape
  std::optional<Vec3> inertia;  ///< moments of inertia Ixx, Iyy, Izz about the centre of mass; default:
                                ///< computed from the shape
  Vec3 inertia_products = Vec3::Zero();  ///< products of inertia Ixy, Iyz, Izx; they need `inertia`
  Real linear_drag = 0;
  Real angular_drag = 0;
  Vec3 friction_axis = Vec3::Zero();  ///< friction axis of the surface, in the body's frame
  /// Velocity of the surface relative to the body, in the body's frame.
  Vec3 surface_velocity = Vec3::Zero();
  bool collides = true;
  bool visible = true;
  bool casts_shadow = true;
  std::optional<Real> bevel;  ///< radius of the drawn edges of its boxes [m]; default: see DrawnShape
  std::vector<BodyKey> keyframes;
  sim::Interpolation interpolation = sim::Interpolation::monotone;
  bool loop = false;
  Vec3 spin = Vec3::Zero();
  Real appear_at = 0;
  Real remove_at = 1e30;
  Placement placement;  ///< in the file, the keys of the placement are keys of the body

  /// Returns whether an animation moves the parts of the body's collision shape.
  bool has_animated_shape() const { return animation && !model && std::holds_alternative<MeshFile>(shape); }
};

/// One end of a spring: a point of the world, a point of a body (in its frame), or one particle of a group.
struct SpringEnd {
  std::string body;
  std::string particles;
  int index = 0;  ///< index of the particle in its group
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
  Real radius = 0.01;  ///< radius of the drawn rod
  std::string material;
};

/// The look of the lines of an overlay.
struct LineLook {
  Real width = 0.003;  ///< fraction of the picture's height
  Real hidden = 0.3;   ///< opacity of parts behind other objects
};

enum class BoundingVolumeKind { aabb, obb, sphere };

/// Draws one level of the bounding-volume tree of a mesh body.
struct TreeOverlay : LineLook {
  Where where;
  std::string body;
  BoundingVolumeKind volume = BoundingVolumeKind::obb;
  /// Level that is drawn, 0 is the root; between two integers the levels fade into each other.
  Varying level = 3.0;
};
/// Draws the convex parts of a mesh body in different colours, instead of the body.
struct PartsOverlay {
  Where where;
  std::string body;
  Varying explode = 0.0;  ///< displacement of each part from the centre, as a fraction of its distance
};
/// Draws the closest points of two bodies, or their penetration if they overlap.
struct ClosestOverlay : LineLook {
  Where where;
  std::string a, b;
  Color color{{1, 0.75f, 0.1f, 1}};
  Color penetrating{{1, 0.08f, 0.05f, 1}};
};
/// Draws contact points of bodies and the directions of their forces. The simulation has no contacts between
/// bodies that are not dynamic; for them the contact points are computed from the geometry.
struct ContactsOverlay : LineLook {
  Where where;
  std::string a, b;      ///< names of two bodies; both empty: all pairs of bodies
  Real margin = 0.01;    ///< greatest distance of a contact computed from the geometry [m]
  Real size = 0.06;      ///< radius of the ring around a point; its arrow is four times as long
  Real force_scale = 0;  ///< length of an arrow per newton of the contact's force
  Color color{{1, 0.75f, 0.1f, 1}};
};
/// Draws velocities of bodies as arrows from their centres of mass.
struct VelocitiesOverlay : LineLook {
  Where where;
  std::string body;        ///< name of a body; empty: all moving bodies
  Real scale = 0.2;        ///< length per m/s
  Real angular_scale = 0;  ///< length of a second arrow along the axis of rotation, per rad/s
  Color color{{0.2f, 0.8f, 1, 1}};
  Color angular_color{{1, 0.3f, 0.8f, 1}};
};
/// Draws a box around each body, in the colour of its island.
struct IslandsOverlay : LineLook {
  Where where;
  Real asleep = 0.25;  ///< brightness of bodies that are asleep
};
/// Draws the positions, free axes and loads of joints.
struct JointsOverlay : LineLook {
  Where where;
  std::string joint;     ///< name of a joint; empty: all joints
  Real size = 0.08;      ///< radius of the ring around an axis; the axis is drawn four times as long
  Real force_scale = 0;  ///< length of an arrow per newton on body a; 0: no arrows
  Color color{{1, 0.45f, 0.1f, 1}};
  Color force_color{{0.2f, 0.8f, 1, 1}};
};
/// Draws the threads of cloths in colours of their strain, from blue (0) to red (`strain`).
struct ClothOverlay : LineLook {
  Where where;
  std::string cloth;   ///< name of a cloth; empty: all cloths
  Real strain = 0.05;  ///< strain at which a thread is red
};
/// Draws the paths along which the centres of mass of bodies have moved.
struct TrailsOverlay : LineLook {
  Where where;
  std::string body;            ///< name of a body; empty: all dynamic bodies
  Real duration = 1;           ///< time span of the path [s]
  std::optional<Color> color;  ///< colour of the paths; default: a different colour for each body
};
enum class TextPlace { top_left, top_right, bottom_left, bottom_right, center };
/// Text on the picture.
struct TextOverlay {
  Where where;
  std::string text = "{time}";
  TextPlace place = TextPlace::bottom_left;
  Real size = 0.035;  ///< height of a line of text, as a fraction of the picture's height
  Color color{{1, 1, 1, 1}};
  Real from = 0;  ///< time at which the text appears [s]
  std::optional<Real> until;
};
/// Lines and text over the picture that show the state of the simulation.
using Overlay = std::variant<TreeOverlay, PartsOverlay, ClosestOverlay, ContactsOverlay, VelocitiesOverlay,
                             IslandsOverlay, JointsOverlay, ClothOverlay, TrailsOverlay, TextOverlay>;

/// The keys that all cameras have.
struct Lens {
  Real fov_deg = 40;
  std::optional<Real> focal_mm;  ///< replaces fov_deg
  Real aperture = 0;
  Real focus = 0;
  std::string focus_on;          ///< body on which the camera focuses; replaces `focus`
  std::string look_at;           ///< body to which the camera points; replaces the target
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
  /// Field of view and focus distance at this key; default: those of the camera.
  std::optional<Real> fov_deg, focus;
  /// Interpolation to the next key; default: the interpolation of the camera.
  std::optional<sim::Interpolation> interpolation;
};
struct KeyframedCamera : Lens {
  std::vector<CameraKey> keyframes;
  sim::Interpolation interpolation = sim::Interpolation::monotone;
};
struct OrbitCamera : Lens {
  Vec3 target = Vec3::Zero();
  Real radius = 8;
  Real height = 3;     ///< height of the eye above the target
  Real start_deg = 0;  ///< angle at time 0, from +Z towards +X
  Real turn_deg_per_s = 20;
};
struct FollowCamera : Lens {
  std::string body;
  Vec3 offset = {0, 2, 6};  ///< position of the eye relative to the body, world axes
  Vec3 look_offset = Vec3::Zero();
};
/// A camera of a body's model file. The file gives its field of view.
struct ModelCamera : Lens {
  Where where;
  std::string body;
  std::string name;  ///< name of the camera in the file; empty: the first camera
};
using Camera = std::variant<StaticCamera, KeyframedCamera, OrbitCamera, FollowCamera, ModelCamera>;

/// A further camera, which the option `--camera` selects.
struct NamedCamera {
  Where where;
  std::string name;
  Camera camera = StaticCamera{};
};
inline constexpr const char* kMainCamera = "main";  ///< selects Scene::camera
inline constexpr const char* kAllCameras = "all";   ///< selects all cameras

struct SunLight {
  Vec3 direction = {0.45, 0.75, 0.5};  ///< direction towards the sun
  Color color{{1, 0.95f, 0.87f, 1}};
  Real intensity = 3;
  Real size_deg = 1.5;
  bool shadows = true;
};
/// The keys of all lights that have a position, which are all lights except the sun.
struct LampBase {
  Where where;
  std::string body;  ///< body that carries the light; empty: fixed in the world
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
/// Lights of a body's model file.
struct ModelLights {
  Where where;
  std::string body;
  std::string name;     ///< name of the light's node; empty: all lights of the file
  Real intensity = 1;   ///< factor of the intensities of the lights
  Real radius = 0.01;   ///< radius of point and spot lights
  Real size_deg = 0.5;  ///< angular diameter of directional lights
  bool shadows = true;
};
using Light = std::variant<SunLight, PointLight, SpotLight, AreaLight, ModelLights>;

enum class Background { sky, transparent };

/// A picture of the whole sky, which lights the scene and is its background.
struct SkyPictureSettings {
  Where where;
  std::string file;
  Real turn_deg = 0;
  Real blur_deg = 0;
  bool visible = true;
};

struct EnvironmentSettings {
  Color zenith{{0.2f, 0.42f, 0.88f, 1}};
  Color horizon{{0.95f, 1.05f, 1.15f, 1}};
  /// Colour below the horizon; default: the light that the ground plane reflects.
  std::optional<Color> ground;
  Real intensity = 1;
  Real fog = 0;
  Real clouds = 0;
  Background background = Background::sky;
  std::optional<SkyPictureSettings> picture;
};

/// Number of sub-frames per frame: draft 1 (with an edge filter), preview 4, final 16. The quality never
/// changes the simulation.
enum class Quality { draft, preview, final };
int subframes(Quality quality);

/// Choice of the exposure. `automatic` chooses it for each frame so that all frames have the same mean
/// brightness.
enum class Metering { fixed, automatic };

struct RenderSettings {
  Eigen::Vector2i size = {1280, 720};
  Quality quality = Quality::preview;
  Real shutter = 0.5;  ///< fraction of the frame time during which the shutter is open
  Varying exposure = 1.0;
  Metering metering = Metering::fixed;
  Real bloom = 0.12;  ///< fraction of the light brighter than white that spreads as glow
  render::ToneCurve tone_curve = render::ToneCurve::filmic;
};

struct OutputSettings {
  render::FrameRate fps;  ///< frames per second
  Real duration = 5;
  /// Time of frame 1: earlier times are simulated but not shown (for a fountain that is already running).
  Real start = 0;
  std::vector<render::Channel> channels;  ///< numeric channels, in files beside the frames or the video
  render::ChannelFormat channel_format = render::ChannelFormat::exr;

  /// Returns the time of frame k [s], k from 1.
  Real time_of(int frame) const { return start + fps.seconds(frame - 1); }
};

struct Scene {
  int version = 1;
  std::string name;  ///< name of the scene; default: the name of the file
  std::string description;
  std::string fill_digest;  ///< after loading: digest of the models that fills read; empty if there are none
  WorldSettings world;
  std::vector<Material> materials;
  std::vector<ContactRule> contacts;
  std::vector<Body> bodies;
  std::vector<ParticleGroup> particles;
  std::vector<Emitter> emitters;
  /// Presets that are placed in the scene. Loading moves their emitters and forces to the lists of the scene.
  std::vector<Effect> effects;
  std::vector<Spring> springs;
  std::vector<Joint> joints;
  /// Ready-made articulations. Expanding the copies replaces them by their bodies and joints.
  std::vector<ArticulationTemplate> articulations;
  std::vector<Cloth> cloths;
  std::vector<Force> forces;
  std::vector<Overlay> overlays;
  Camera camera = StaticCamera{};
  std::vector<NamedCamera> cameras;
  std::vector<Light> lights = {SunLight{}};
  EnvironmentSettings environment;
  RenderSettings render;
  OutputSettings output;

  /// Frames are numbered from 1; frame k shows the time start + (k - 1) / fps.
  int frame_count() const;
};

}  // namespace offstage::producer
