#pragma once
/// The drawing side of a scene: builds a stage and turns pairs of snapshots into finished frames. Between the
/// two states of a pair it interpolates (slerp for bodies, cubic for particles and cloths), so that
/// sub-frames at different times give motion blur.

#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "producer/build/body_places.h"
#include "producer/build/camera.h"
#include "producer/build/models.h"
#include "producer/build/object_table.h"
#include "producer/build/snapshot.h"
#include "producer/scene/scene.h"
#include "render/channels.h"
#include "render/image.h"
#include "render/stage.h"

namespace offstage::producer {

class Picture {
 public:
  /// Builds the stage of a scene. The context must be current on this thread and outlive the picture.
  /// `quick`: see render::StageDef.
  Picture(const Scene& scene, const ModelLibrary& models, render::Context& context, bool quick = false);

  /// Draws the frame at `current`. The shutter is open during the last part of the interval from `previous`,
  /// the frame before it (or the same snapshot for the first frame, which has no motion blur). The camera is
  /// that of the scene in its current state. If `stop`, which several threads call, returns true, drawing
  /// ends soon and the image has no pixels.
  render::Image draw(const Snapshot& previous, const Snapshot& current,
                     const std::function<bool()>& stop = {});
  /// Returns the linear light of the latest frame with its exposure and glow, without tone curve and texts.
  render::HdrImage linear() const;
  /// Returns the sums of the light in all pictures so far.
  render::LightSums light_sums() const { return stage_.light_sums(); }
  /// Returns the camera of the latest picture.
  const render::Camera& camera() const { return latest_camera_; }

  /// Draws the channels of the frame at `current`: depth, normal, id, and the motion since `previous`. The
  /// arguments are the same as for draw().
  render::Channels channels(const Snapshot& previous, const Snapshot& current);

 private:
  struct DrawnPart {
    render::InstanceHandle instance;
    Eigen::Affine3f body_from_part;
    // Displacement of the part at `explode` = 1, in the body's frame.
    Eigen::Vector3f outwards = Eigen::Vector3f::Zero();
  };
  /// A model that plays an animation.
  struct AnimatedLook {
    struct Surface {
      const render::RigSurface* source;
      render::MeshHandle mesh;
      render::InstanceHandle instance;
    };
    const render::ModelRig* rig;
    const ModelAnimation* animation;
    int clip;
    Eigen::Affine3f body_from_model;
    std::vector<Surface> surfaces;
  };
  struct DrawnBody {
    std::optional<std::size_t> slot;  // index in Snapshot::bodies; none: the body never moves
    Eigen::Affine3f world_from_body;  // pose at time 0
    const PartsOverlay* overlay;      // overlay that draws the body as convex parts; null: there is none
    Real appear_at, remove_at;
    std::vector<DrawnPart> parts;
    std::optional<AnimatedLook> animated;  // the body is drawn as an animated model instead of `parts`
  };

  /// Particles that are drawn as instances of a mesh. Instance i shows the i-th particle of the current
  /// state.
  struct DrawnMeshes {
    const LookMesh* look = nullptr;  // null: the set is drawn by the stage
    struct Part {
      render::MeshHandle mesh;
      render::MaterialHandle material;
      Eigen::Affine3f unit_from_part;  // transform of the mesh to its place in the unit ball
    };
    std::vector<Part> parts;
    bool casts_shadow = true;
    uint32_t object = 0;
    std::vector<render::InstanceHandle> instances;  // one instance for each part of each particle
    std::size_t shown = 0;                          // number of visible particles
  };

  /// A cloth with its coordinates along the flat cloth, and the version of its triangles in the stage.
  struct DrawnCloth {
    render::ClothHandle cloth;  // null if invisible
    std::vector<uint32_t> triangles;
    std::vector<Eigen::Vector2f> uvs;
    Real appear_at = 0, remove_at = 0;
    uint32_t version = 0;
  };

  render::MaterialHandle material(const std::string& name, const ModelLibrary& models);
  void add_body(const ObjectTable::BodyEntry& entry, const ModelLibrary& models);
  /// Returns the parts of a model with their materials. If `name` is not empty, all parts have the material
  /// of this name.
  std::vector<std::pair<render::MeshHandle, render::MaterialHandle>> model_parts(const std::string& file,
                                                                                 const std::string& name,
                                                                                 const ModelLibrary& models);
  void add_model(const std::string& file, const Eigen::Affine3f& body_from_model, const Body& body,
                 const ModelLibrary& models, std::vector<DrawnPart>& parts);
  void add_animated(const std::string& file, const Eigen::Affine3f& body_from_model, const Body& body,
                    const ModelLibrary& models, DrawnBody& drawn);
  void place_animated(const AnimatedLook& look, const Eigen::Affine3f& world_from_body, double time);
  void add_shape(const Body& body, const ModelLibrary& models, std::vector<DrawnPart>& parts);
  void add_convex_parts(const MeshFile& mesh, const Body& body, const ModelLibrary& models,
                        std::vector<DrawnPart>& parts);
  template <class Primitive>
  render::MeshHandle primitive(const Primitive& shape, const Body& body);
  void add_rod(const ObjectTable::RodEntry& rod, const ModelLibrary& models);
  void add_cloth(const ObjectTable::ClothEntry& entry, const ModelLibrary& models);
  render::MaterialHandle cloth_material(const Cloth& cloth, const ModelLibrary& models);
  render::PointsHandle add_blur_streaks(const ParticleLook& look);
  void add_overlay_lines();

  void place(const Snapshot& previous, const Snapshot& current, float w, double frame_time);
  void place_body(const DrawnBody& body, const Eigen::Affine3f& world_from_body, double time);
  void place_rods(const Snapshot& previous, const Snapshot& current, float w);
  void add_points(const ObjectTable::PointsEntry& entry, const ModelLibrary& models);
  void add_particle_mesh(const ParticleLook& look, const ModelLibrary& models, uint32_t object);
  /// Appends the particles of a set at the fraction w (0 to 1) of the frame interval to `points`. `all`: also
  /// particles that are not yet created, extrapolated back along their paths.
  void points_at(std::size_t set, const Snapshot& previous, const Snapshot& current, float w,
                 double frame_time, bool all, std::vector<render::Point>& points) const;
  void place_points(const Snapshot& previous, const Snapshot& current, float w, double frame_time);
  /// Returns the rotations that contacts have given to `points`, which are some of the points of `now`, at
  /// the fraction w of the frame interval; empty if the set stores no rotations.
  static std::vector<Eigen::Quaternionf> orientations_at(const PointSet& before, const PointSet& now, float w,
                                                         std::span<const render::Point> points);
  /// `orientations`: rotation of each point, or empty.
  void place_meshes(DrawnMeshes& drawn, std::span<const render::Point> points,
                    std::span<const Eigen::Quaternionf> orientations);
  /// Returns the time between two sub-frames; 0 if there is only one [s].
  float subframe_time() const;
  void set_balls(std::size_t set, std::span<const render::Point> balls);
  void place_cloths(const Snapshot& previous, const Snapshot& current, float w, double frame_time);
  void give_mesh(DrawnCloth& drawn, const ClothSample& sample);
  void place_overlays(const Snapshot& previous, const Snapshot& current, float w);
  float exposure(double time, float sample_weight) const;

  const Scene& scene_;
  const ModelLibrary& library_;
  render::Stage stage_;
  std::map<std::string, render::MaterialHandle> materials_;
  std::map<std::string, std::pair<std::vector<render::MeshHandle>, std::vector<render::MaterialHandle>>>
      models_;
  std::map<std::vector<float>, render::MeshHandle> primitives_;  // keys: kind and sizes of a shape
  BodyPlaces places_;
  CameraRig camera_;
  render::Camera latest_camera_;
  std::vector<DrawnBody> bodies_;
  // Objects of the stage for the entries of an ObjectTable.
  std::vector<render::InstanceHandle> rods_;  // null if invisible
  std::vector<render::PointsHandle> points_;
  std::vector<render::PointStyle> styles_;  // style of each point set
  std::vector<bool> ages_within_frame_;     // whether a point set's pictures change between sub-frames
  std::vector<DrawnMeshes> meshes_;         // instances of each point set
  // Streaks that replace the balls that move too far in a sub-frame; null: the set has none.
  std::vector<render::PointsHandle> blur_streaks_;
  std::map<std::string, render::MaterialHandle> fabrics_;  // keys: fabric and material
  std::vector<DrawnCloth> cloths_;
  std::vector<render::LinesHandle> overlays_;  // null for overlays without lines
  std::vector<render::Point> scratch_, scratch_blur_streaks_;
  std::vector<Eigen::Vector3f> scratch_places_;
  std::vector<render::Line> scratch_lines_;
  render::HdrImage sum_;
  float latest_scale_ = 1;  // factor from the sum of the sub-frames to exposed light
};

}  // namespace offstage::producer
