#pragma once
/// The stage: the visible objects, and the passes that draw them. It has handles, transforms, meshes, points
/// and materials, and does not depend on physics.
///
/// A frame is the mean of N sub-frames (see sample_offsets). Each is drawn with its own offsets in the pixel,
/// on the sun's disc and in the lens and, if the caller moves objects in between, in time. This one mechanism
/// gives anti-aliasing, soft shadows, depth of field and motion blur.

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "render/channels.h"
#include "render/context.h"
#include "render/file_io.h"
#include "render/handle.h"
#include "render/image.h"
#include "render/model.h"
#include "render/sky_picture.h"

namespace offstage::render {

struct Camera {
  Vector3f eye = {0, 1.5f, 5};
  Vector3f target = Vector3f::Zero();
  Vector3f up = Vector3f::UnitY();
  float fov_deg = 40;                  ///< vertical field of view, in (0, 180)
  float near_m = 1e-4f, far_m = 1e6f;  ///< depths between which objects are visible
  float aperture = 0;                  ///< lens diameter [m]; 0: everything is sharp
  float focus = 0;                     ///< distance in focus [m]; 0: the distance of the target
};

struct Sun {
  Vector3f direction = Vector3f(0.45f, 0.75f, 0.5f).normalized();  ///< unit direction towards the sun
  Vector3f color = {1, 0.95f, 0.87f};
  float intensity = 3;    ///< radiance of a white surface that faces the sun, before exposure
  float size_deg = 1.5f;  ///< diameter of the disc, which sets the softness of shadows
  bool shadows = true;
};

/// A light source near the scene: a glowing ball, a cone, or a rectangle.
struct Lamp {
  Vector3f position = {0, 3, 0};
  Vector3f intensity = {10, 10, 10};  ///< radiance of a white surface that faces the lamp from 1 m away
  float radius = 0.1f;                ///< radius of a ball [m], > 0
  Vector2f size = {0, 0};             ///< size of a rectangle [m]; otherwise zero
  Vector3f direction = {0, -1, 0};    ///< unit direction of cones and rectangles
  float cone_deg = 0;                 ///< full angle of a cone; otherwise zero
  float softness = 0.3f;              ///< fraction of the cone over which the light fades to zero at the edge
  /// Whether the edge of the cone fades with the square of a linear ramp (KHR_lights_punctual), instead of in
  /// proportion to the cosine.
  bool squared_edge = false;
  bool shadows = true;
  /// Whether mirror images show the source of the light, as flames. Surfaces with a mirror image then have no
  /// highlight of the lamp.
  bool in_mirrors = false;
};

/// The sky with its ambient light, and the fog. Colours are radiances.
struct Environment {
  Vector3f zenith = {0.20f, 0.42f, 0.88f};
  Vector3f horizon = {0.95f, 1.05f, 1.15f};
  Vector3f ground = {0.36f, 0.33f, 0.28f};  ///< colour below the horizon, and of the light from below
  float intensity = 1;                      ///< scales sky and ambient together
  /// Albedo of the ground, which reflects the light of sun and sky; replaces `ground`.
  std::optional<Vector3f> ground_albedo = {};
  float clouds = 0;  ///< fraction of the sky covered by clouds
  /// Density [1/m]; transmittance exp(-fog * distance). 0: nothing fades with distance.
  float fog = 0;
  bool visible = true;  ///< whether the sky is drawn; false: the background is transparent, and the sky only
                        ///< lights the scene
  /// A picture of the sky that lights the scene in place of the colours, scaled by `intensity`; null: none.
  /// Clouds are then not drawn.
  std::shared_ptr<const SkyPicture> picture = {};
  /// Rotation of the picture about +Y [degrees], counter-clockwise as seen from above.
  float picture_turn_deg = 0;
  /// Whether the background shows the picture; false: the background and the fog keep the colours above.
  bool picture_visible = true;
};

/// One drawn particle.
struct Point {
  Vector3f position;
  Vector3f velocity;  ///< [m/s], stretches streaks
  float radius;       ///< [m]
  Vector4f color;     ///< linear, straight alpha
  uint64_t id;        ///< breaks ties when sorting, and selects the shape of a puff
  float age = 0;      ///< [s], turns puffs slowly, and selects the picture of a sheet
  float angle = 0;    ///< rotation of a sprite or flake about the line of sight [rad]
};

enum class PointStyle {
  sprite,  ///< soft round billboard, sorted, depth-faded
  streak,  ///< billboard stretched along its motion during the exposure: rain, sparks, water
  sphere,  ///< opaque lit ball
  smoke,   ///< puff with an irregular edge, lit through the other puffs between it and the sun
  /// Flame along its motion; it glows independently of `additive` and `lit`, and hides the background
  /// slightly.
  fire,
  flake,  ///< thin irregular disc, bright against the light: snow, dust
};

/// Pictures of a flip-book in one image, in rows from the upper left corner.
struct SpriteSheet {
  int columns = 1, rows = 1;
  float fps = 12;             ///< pictures per second of a particle's age, >= 0
  bool blend = true;          ///< whether each picture fades to the next; false: pictures change at once
  bool loop = true;           ///< whether the first picture follows the last; false: the last one stays
  bool random_start = false;  ///< whether particles start with different pictures
};
inline constexpr int kMostSheetPictures = 1024;

struct PointsDef {
  PointStyle style = PointStyle::sprite;
  bool additive = false;  ///< whether particles add light instead of covering: fire, sparks
  /// Whether particles are lit by sun and sky; false: their colour is their radiance.
  bool lit = true;
  bool casts_shadow = true;  ///< whether particles cast shadows on the scene, and smoke also on other smoke
  float softness = 0.5f;     ///< width of the fade at the rim, as a fraction of the radius, in [0, 1]
  /// Exposure time that determines the length of streaks [s]: velocity * stretch_s. Other styles, except
  /// balls, are lengthened by the same distance.
  float stretch_s = 1.0f / 60;
  /// Fraction by which a streak fades towards its tail, in [0, 1]: 0 for a drop, 1 for a spark.
  float taper = 0;
  float metallic = 0, roughness = 0.3f;  ///< material of spheres: fraction of metal, and roughness
  SpriteSheet sheet = {};                ///< division of the picture of sprites
};

/// A line with round ends. It faces the eye, is not lit, and casts no shadow. A line with equal end points is
/// a dot. A line with a wide and a narrow end is the head of an arrow.
struct Line {
  Vector3f a, b;
  Vector4f color;                  ///< linear, straight alpha
  float width_a = 1, width_b = 1;  ///< factors of the set's width at the two ends
};

struct LinesDef {
  float width = 0.0025f;  ///< fraction of the picture's height, so that large and small pictures look alike
  float hidden = 0;       ///< opacity of the parts hidden by opaque objects, in [0, 1]
};

/// A thin flexible sheet of triangles. It is drawn smooth, from both sides, with the fabric of its material.
struct ClothDef {
  std::vector<uint32_t> triangles;  ///< three vertices each, counter-clockwise seen from the front
  std::vector<Vector2f> uvs;        ///< position of each vertex along the cloth [m]
  float thickness = 0.001f;         ///< [m], >= 0
  Vector2f texture_size = {1, 1};   ///< size of one copy of the material's texture on the cloth [m], > 0
  bool casts_shadow = true;
};

/// Offsets of one sub-frame, each in the square [-0.5, 0.5]^2. The stage maps the offsets of lens and light
/// to discs.
struct SampleOffsets {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  Eigen::Vector2f lens = Eigen::Vector2f::Zero();
  Eigen::Vector2f light = Eigen::Vector2f::Zero();
  int index = 0;  ///< number of the sub-frame
  /// Number of sub-frames in the frame. If there are several, the noise filter is applied to their mean, not
  /// to each of them.
  int count = 1;
  /// Whether the mean of the sub-frames has so little noise that each of them needs fewer rays.
  bool are_many() const { return count >= 16; }
};
/// Offsets of sub-frame i of n: a fixed low-discrepancy set; all zero for n = 1.
SampleOffsets sample_offsets(int i, int n);

/// Sums over the radiance that rays found for indirect light and mirror images.
struct LightSums {
  double arriving = 0;  ///< luminance of the light of these rays
  /// Luminance that was removed from the brightest rays, which would otherwise be visible as dots.
  double removed = 0;

  LightSums& operator+=(const LightSums& other) {
    arriving += other.arriving;
    removed += other.removed;
    return *this;
  }
};

struct StageDef {
  int width_px = 1280, height_px = 720;
  /// Whether pictures are drawn faster and less exactly, for previews. The light of the sun and indirect
  /// light are then traced for some of the pixels, and interpolated for the others.
  bool quick = false;
};

class Stage {
 public:
  /// Creates an empty stage. The context must be current, and must outlive the stage.
  Stage(Context& context, const StageDef& def);
  ~Stage();
  Stage(Stage&&) noexcept;

  MeshHandle add_mesh(const Mesh& mesh);
  /// Replaces a mesh, for instance by its next pose; all instances of it change.
  void set_mesh(MeshHandle handle, const Mesh& mesh);
  /// Adds a material. Its indices refer to `textures`; each call uploads each texture once, with mip maps.
  MaterialHandle add_material(const Material& material, std::span<const Image> textures = {});
  InstanceHandle add_instance(MeshHandle mesh, MaterialHandle material, bool casts_shadow = true);
  /// Adds a set of particles. `picture`: image that is drawn for each sprite instead of a soft disc; empty:
  /// none. The longer side of the image is the diameter of the particle. Throws std::invalid_argument if the
  /// sheet has more than kMostSheetPictures pictures, or none.
  PointsHandle add_points(const PointsDef& def, const Image& picture = {});
  LinesHandle add_lines(const LinesDef& def);
  /// Adds a cloth, which is not visible before set_cloth(). Throws std::invalid_argument for an index out of
  /// range.
  ClothHandle add_cloth(const ClothDef& def, MaterialHandle material);

  void remove(InstanceHandle instance);
  void remove(PointsHandle points);
  void remove(LinesHandle lines);
  void remove(ClothHandle cloth);

  void set_transform(InstanceHandle instance, const Eigen::Affine3f& world_from_mesh);
  void set_visible(InstanceHandle instance, bool visible);
  void set_points(PointsHandle points, std::span<const Point> values);
  void set_lines(LinesHandle lines, std::span<const Line> values);

  /// Sets the positions of a cloth's vertices in the world; throws std::invalid_argument if their number is
  /// wrong.
  void set_cloth(ClothHandle cloth, std::span<const Vector3f> positions);
  /// Sets other triangles of a cloth, for instance after it tore. It is not visible before the next
  /// set_cloth().
  void set_cloth_mesh(ClothHandle cloth, std::span<const uint32_t> triangles, std::span<const Vector2f> uvs);

  void set_camera(const Camera& camera);
  void set_sun(const Sun& sun);
  void set_environment(const Environment& environment);
  void set_lamps(std::span<const Lamp> lamps);
  /// Sets the time of animated surfaces such as ripples and clouds [s].
  void set_time(float time);

  /// Draws one sub-frame and adds it to `sum`. If `sum` does not have the size of the stage, it is resized
  /// and cleared first. Throws UnavailableError on a GL error. Several threads call `stop`; soon after it
  /// returns true, draw() throws StoppedError and does not change `sum`.
  void draw(const SampleOffsets& offsets, HdrImage& sum, const StopTest& stop = {});
  /// Returns the sums over all sub-frames that were drawn so far.
  LightSums light_sums() const;

  /// Sets the object id of an instance in Channels; 0, the default: none.
  void set_object(InstanceHandle instance, uint32_t id);
  void set_object(ClothHandle cloth, uint32_t id);
  void set_object(PointsHandle points, uint32_t id);
  /// Stores the current transforms and camera as the previous ones for Channels::motion.
  void store_previous_transforms();
  /// Draws depth, normals, ids and motion of the current state. `time`: time since
  /// store_previous_transforms() [s]. The previous positions of balls are computed from their velocity.
  Channels channels(float time);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace offstage::render
