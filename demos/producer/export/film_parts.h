#pragma once
/// The data of a film that do not change over time, for export: meshes, materials, and the objects that use
/// them. The positions of the objects are in snapshots; indices here refer to the lists of a Snapshot.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "producer/build/body_places.h"
#include "producer/build/camera.h"
#include "producer/build/models.h"
#include "producer/scene/scene.h"
#include "render/model.h"
#include "render/stage.h"

namespace offstage::producer {

struct FilmMaterial {
  std::string name;       ///< name of the material: unique, not empty
  render::Material look;  ///< its maps have indices of FilmParts::textures
};

/// The transform of texture coordinates of a map as in KHR_texture_transform: scale, then rotation (positive
/// turns the image clockwise), then offset; v points downwards.
struct UvTransform {
  Eigen::Vector2f scale = {1, 1}, offset = {0, 0};
  float angle = 0;  ///< [rad]

  bool is_identity() const { return scale.isOnes(0) && offset.isZero(0) && angle == 0; }
};
/// Returns the transform of a map. The result is the identity for a map that is projected along three axes,
/// because its coordinates are not those of the mesh.
UvTransform uv_transform(const render::Material& look, const render::TextureMap& map);

/// A mesh with a material, placed in the frame of a body. `mesh` and `material` are indices in FilmParts.
struct FilmPart {
  std::size_t mesh = 0, material = 0;
  Eigen::Affine3f body_from_part = Eigen::Affine3f::Identity();
};

/// The times between which an object exists [s].
struct Lifetime {
  Real appear_at = 0, remove_at = kForever;

  bool is_limited() const { return appear_at > 0 || remove_at < kForever; }
  bool contains(double time) const { return exists(appear_at, remove_at, time); }
};

struct FilmBody {
  std::string name;
  std::optional<std::size_t> slot;  ///< index in Snapshot::bodies; empty: the body never moves
  BodySample place;                 ///< pose at time 0
  std::vector<FilmPart> parts;
  Lifetime lifetime;
};

/// A spring, rod or rope: a cylinder of length 1 along Y, which is placed between two points.
struct FilmRod {
  std::string name;
  std::size_t rod = 0;  ///< index in Snapshot::rods
  std::size_t mesh = 0, material = 0;
};

struct FilmCloth {
  std::string name;
  Lifetime lifetime;
  std::size_t cloth = 0;  ///< index in Snapshot::cloths
  std::size_t material = 0;
  std::vector<uint32_t> triangles;  ///< triangles of the untorn cloth, as indices of its vertices
  /// Texture coordinates of the vertices of the untorn cloth: 0 .. 1 over its extent, v upwards.
  std::vector<Eigen::Vector2f> uvs;
};

struct FilmPoints {
  std::string name;
  std::size_t set = 0;    ///< index in Snapshot::point_sets
  bool glows = false;     ///< whether the particles emit light in their colour
  bool are_balls = true;  ///< whether they are drawn as balls, not as smoke, streaks, pictures or meshes
};

/// The meshes, materials and objects of a film. Invisible objects are omitted. Names are unique among objects
/// of the same kind.
class FilmParts {
 public:
  FilmParts(const Scene& scene, const ModelLibrary& models);

  const Scene& scene;
  std::vector<render::Mesh> meshes;
  std::vector<FilmMaterial> materials;
  std::vector<render::Image> textures;
  std::vector<FilmBody> bodies;
  std::vector<FilmRod> rods;
  std::vector<FilmCloth> cloths;
  std::vector<FilmPoints> points;
  std::vector<std::string> lamps;  ///< names of the lights, in the order of lamps_at()
  render::Sun sun;

  /// Returns the picture of a map; null if it has none.
  const render::Image* texture(const render::TextureMap& map) const {
    return map.image < 0 ? nullptr : &textures[static_cast<std::size_t>(map.image)];
  }
  /// Returns whether a map has a picture with translucent pixels.
  bool has_alpha(const render::TextureMap& map) const;
  /// Each function returns the camera or the lights at the time of a snapshot.
  render::Camera camera_at(const Snapshot& snapshot) const;
  std::vector<render::Lamp> lamps_at(const Snapshot& snapshot) const;

 private:
  class Builder;
  BodyPlaces places_;
  const ModelLibrary& models_;
  CameraRig camera_;
};

/// Returns the transform that places the unit cylinder of a rod between the rod's ends, in the world. Returns
/// nothing if the rod does not exist.
std::optional<Eigen::Affine3f> rod_transform(const RodSample& rod);

/// Triangles, texture coordinates and normals of a cloth in a frame.
struct ClothSurface {
  const std::vector<uint32_t>* triangles;
  std::vector<Eigen::Vector2f> uvs;
  /// Normals of the vertices: the means of the normals of their triangles, weighted by area.
  std::vector<Eigen::Vector3f> normals;
};
/// Returns the surface of a cloth in a frame. `cloth` and `sample` must outlive the result.
ClothSurface cloth_surface(const FilmCloth& cloth, const ClothSample& sample);

}  // namespace offstage::producer
