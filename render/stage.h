#pragma once
/// The stage: what there is to see, and the passes that draw it. It knows handles, transforms, meshes, points
/// and materials, and nothing of physics.
///
/// A frame is the mean of N sub-frames (see sample_offsets), each drawn with its own offsets in the pixel, on
/// the sun's disc, in the lens and, by the caller moving things in between, in time. That one mechanism gives
/// anti-aliasing, soft shadows, depth of field and motion blur.

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "render/channels.h"
#include "render/context.h"
#include "render/handle.h"
#include "render/image.h"
#include "render/model.h"

namespace offstage::render {

struct Camera {
  Vector3f eye = {0, 1.5f, 5};
  Vector3f target = Vector3f::Zero();
  Vector3f up = Vector3f::UnitY();
  float fov_deg = 40;  ///< vertical, in (0, 180)
  float near_m = 0.05f, far_m = 1e6f;
  float aperture = 0;  ///< lens diameter [m]; 0: everything is sharp
  float focus = 0;     ///< distance in focus [m]; 0: the target's
};

struct Sun {
  Vector3f direction = Vector3f(0.45f, 0.75f, 0.5f).normalized();  ///< towards the sun, unit
  Vector3f color = {1, 0.95f, 0.87f};
  float intensity = 3;    ///< radiance of a white surface facing it, before exposure
  float size_deg = 1.5f;  ///< diameter of the disc: the softness of shadows
  bool shadows = true;
};

/// A source of light near the scene: a glowing ball, cone, or rectangle.
struct Lamp {
  Vector3f position = {0, 3, 0};
  Vector3f intensity = {10, 10, 10};  ///< radiance of a white surface 1 m away that faces it
  float radius = 0.1f;                ///< of a ball [m], > 0
  Vector2f size = {0, 0};             ///< of a rectangle [m]; else zero
  Vector3f direction = {0, -1, 0};    ///< in which cones and rectangles shine, unit
  float cone_deg = 0;                 ///< of a cone, across; else zero
  float softness = 0.3f;              ///< share of the cone over which its edge fades
  bool shadows = true;
};
inline constexpr std::size_t kMostLamps = 8;        ///< that light at once; the strongest do
inline constexpr std::size_t kMostLampShadows = 4;  ///< of these, the first that want to

/// Sky, ambient light from it, and fog towards its horizon.
struct Environment {
  Vector3f zenith = {0.20f, 0.42f, 0.88f};
  Vector3f horizon = {0.95f, 1.05f, 1.15f};
  Vector3f ground = {0.36f, 0.33f, 0.28f};  ///< seen below the horizon, and light from below
  float intensity = 1;                      ///< scales sky and ambient together
  /// Of the ground that sends back the light of sun and sky, in place of `ground`.
  std::optional<Vector3f> ground_albedo = {};
  float clouds = 0;  ///< share of the sky that they cover
  /// Density [1/m]; transmittance exp(-fog * distance). 0: nothing fades with distance.
  float fog = 0;
  /// How far away things hide the sky from each other [m]; 0: not at all; none: a tenth of the camera's
  /// distance to its target.
  std::optional<float> occlusion_reach = {};
  bool visible = true;  ///< false: transparent background; it still lights the scene
};

/// One drawn particle.
struct Point {
  Vector3f position;
  Vector3f velocity;  ///< [m/s], stretches streaks
  float radius;       ///< [m]
  Vector4f color;     ///< linear, straight alpha
  uint64_t id;        ///< breaks ties when sorting, and gives a puff its shape
  float age = 0;      ///< [s], turns puffs slowly
};

enum class PointStyle {
  sprite,  ///< soft round billboard, sorted, depth-faded
  streak,  ///< billboard stretched along its motion during the exposure: rain, sparks, water
  sphere,  ///< opaque lit ball
  smoke,   ///< puff with a broken edge, lit through the other puffs between it and the sun
  fire,    ///< tongue of flame along its motion: it glows, whatever `additive` and `lit` say, and hides a
           ///< little
  flake,   ///< thin irregular disc, bright against the light: snow, dust
};

struct PointsDef {
  PointStyle style = PointStyle::sprite;
  bool additive = false;     ///< add light instead of covering: fire, sparks
  bool lit = true;           ///< by sun and sky; false: its colour is its light
  bool casts_shadow = true;  ///< on the scene; of smoke on other smoke, too
  float softness = 0.5f;     ///< width of the fade at the rim, as a share of the radius, in [0, 1]
  float stretch_s =
      1.0f / 60;    ///< streaks are velocity * stretch_s long, others but balls and sprites longer by it [s]
  float taper = 0;  ///< share by which a streak fades towards its tail, in [0, 1]: 0 a drop, 1 a spark
  float metallic = 0, roughness = 0.3f;  ///< of spheres
};

/// The stroke of a round pen: it faces the eye, is not lit, and shadows nothing. Where both ends are the same
/// it is a dot; from a wide end to a narrow one, the head of an arrow.
struct Line {
  Vector3f a, b;
  Vector4f color;                  ///< linear, straight alpha
  float width_a = 1, width_b = 1;  ///< factors of the set's width at the two ends
};

struct LinesDef {
  float width = 0.0025f;  ///< share of the picture's height, so that large and small pictures look alike
  float hidden = 0;       ///< opacity of what opaque things hide, in [0, 1]
};

/// A thin sheet of triangles that bends: drawn smooth, from both sides, with the fabric of its material.
struct ClothDef {
  std::vector<uint32_t> triangles;  ///< three vertices each, counter-clockwise seen from the front
  std::vector<Vector2f> uvs;        ///< place of each vertex along the cloth [m]
  float thickness = 0.001f;         ///< [m], >= 0
  Vector2f texture_size = {1, 1};   ///< of one copy of the material's texture on the cloth [m], > 0
  bool casts_shadow = true;
};

/// Offsets of one sub-frame, each in [-0.5, 0.5] (pixel, lens and light squares; mapped to discs inside).
struct SampleOffsets {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  Eigen::Vector2f lens = Eigen::Vector2f::Zero();
  Eigen::Vector2f light = Eigen::Vector2f::Zero();
  int index = 0;  ///< of the sub-frame
  int count = 1;  ///< of sub-frames in the frame: among many, one needs no filtering of its own
};
/// Offsets of sub-frame i of n: a fixed low-discrepancy set; all zero for n = 1.
SampleOffsets sample_offsets(int i, int n);

struct StageDef {
  int width_px = 1280, height_px = 720;
  int shadow_map_px = 2048;
};

class Stage {
 public:
  /// The context must be current, and outlive the stage.
  Stage(Context& context, const StageDef& def);
  ~Stage();
  Stage(Stage&&) noexcept;

  MeshHandle add_mesh(const Mesh& mesh);
  /// `textures` are those the material's indices refer to; each is uploaded once per call, with mip maps.
  MaterialHandle add_material(const Material& material, std::span<const Image> textures = {});
  InstanceHandle add_instance(MeshHandle mesh, MaterialHandle material, bool casts_shadow = true);
  PointsHandle add_points(const PointsDef& def);
  LinesHandle add_lines(const LinesDef& def);
  /// Nothing is seen of it before set_cloth. Throws std::invalid_argument for triangles of vertices that have
  /// no place.
  ClothHandle add_cloth(const ClothDef& def, MaterialHandle material);

  void remove(InstanceHandle instance);
  void remove(PointsHandle points);
  void remove(LinesHandle lines);
  void remove(ClothHandle cloth);

  void set_transform(InstanceHandle instance, const Eigen::Affine3f& world_from_mesh);
  void set_visible(InstanceHandle instance, bool visible);
  void set_points(PointsHandle points, std::span<const Point> values);
  void set_lines(LinesHandle lines, std::span<const Line> values);

  /// Where the vertices of a cloth are in the world; throws std::invalid_argument if their number is wrong.
  void set_cloth(ClothHandle cloth, std::span<const Vector3f> positions);
  /// Gives a cloth other triangles, as after it tore. It is not seen again before set_cloth.
  void set_cloth_mesh(ClothHandle cloth, std::span<const uint32_t> triangles, std::span<const Vector2f> uvs);

  void set_camera(const Camera& camera);
  void set_sun(const Sun& sun);
  void set_environment(const Environment& environment);
  void set_lamps(std::span<const Lamp> lamps);
  /// The time of self-animated things such as ripples and clouds [s].
  void set_time(float time);

  /// Draws one sub-frame and adds it to `sum`, which is sized and cleared first if it does not have the
  /// stage's size. Throws UnavailableError on a GL error.
  void draw(const SampleOffsets& offsets, HdrImage& sum);

  /// Whose it is in Channels; 0, the default: nobody's.
  void set_object(InstanceHandle instance, uint32_t id);
  void set_object(ClothHandle cloth, uint32_t id);
  void set_object(PointsHandle points, uint32_t id);
  /// Motion is measured from where everything is now, camera included.
  void store_previous_transforms();
  /// Depth, normals, ids and motion of what is in place. `time`: since `store_previous_transforms` [s], by
  /// which balls moved on with their velocity.
  Channels channels(float time);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace offstage::render
