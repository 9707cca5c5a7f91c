#pragma once
/// Private: the scene for ray tracing: triangles and balls with their materials, in bounding volume
/// hierarchies by Embree. Embree only finds the object and the triangle. The hit point is computed here, so
/// that its bits do not depend on Embree's version.

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "render/cloth_surface.h"
#include "render/lanes.h"
#include "render/model.h"
#include "render/trace/ray_material.h"
#include "render/trace/ray_tree.h"

namespace offstage::render {

/// Returns the version of Embree and its instruction set, for example "Embree 3.13.5 avx2".
std::string ray_library();

/// A mesh with its hierarchy, which is built on first use.
class RayMesh {
 public:
  /// Copies the data that rays need. `normals`: one for each position.
  RayMesh(const Mesh& mesh, const std::vector<Vector3f>& normals);
  RTCSceneTy* tree() const;
  /// Returns the corners of a triangle in the world.
  std::array<Vector3f, 3> corners(unsigned triangle, const Eigen::Affine3f& world_from_mesh) const;
  /// Returns both sets of texture coordinates at a point of a triangle. `barycentric`: weights of its second
  /// and third corner.
  std::array<Vector2f, 2> uvs_at(unsigned triangle, const Vector2f& barycentric) const;
  /// Returns the texture coordinates of a vertex.
  const Vector2f& uv_of(std::size_t vertex, int set) const;
  /// Returns whether the mesh is a pane: nearly its whole surface consists of parallel planes that are close
  /// to each other. Light has the same direction before and behind it, and nothing lies inside of it.
  bool is_plate() const;
  /// Returns the area of all triangles, in square units of the mesh.
  float area() const;
  /// Chooses a triangle with a probability in proportion to its area. `choice`: random number in [0, 1).
  /// chance_of() returns the probability of a triangle.
  unsigned triangle_at(float choice) const;
  float chance_of(unsigned triangle) const;

  std::vector<Vector4f> positions;  ///< w is not used; Embree reads 16 bytes
  std::vector<Vector3f> normals;
  std::vector<Vector2f> uvs, second_uvs;  ///< texture coordinates of the vertices; empty: none
  std::vector<Vector4f> tangents;         ///< see Mesh::tangents
  std::vector<Vector4f> colors;           ///< colours of the vertices; empty: none
  std::vector<uint32_t> indices;

 private:
  const std::vector<float>& areas() const;
  mutable RayTree tree_;
  mutable std::vector<float> area_up_to_;  ///< sum of the areas up to each triangle; computed on first use
  mutable std::optional<bool> is_plate_;   ///< computed on first use
};

/// The first hit of a ray.
struct Hit {
  float distance = 0;  ///< distance along the ray [m]
  Vector3f position = Vector3f::Zero();
  Vector3f normal = Vector3f::Zero();         ///< smooth unit normal, on the side of the ray's origin
  Vector3f smooth_normal = Vector3f::Zero();  ///< the same without the relief of the material
  /// The smooth normal as the picture uses it to trace the light of lamps and glowing meshes.
  Vector3f lamp_normal = Vector3f::Zero();
  Vector3f face = Vector3f::Zero();  ///< unit normal of the triangle, on the side of the ray's origin
  bool front = true;                 ///< whether the ray hits the front of the surface
  const RayMaterial* material = nullptr;
  bool is_cloth = false;
  float translucency = 0;  ///< translucency of a cloth; 0 for other objects
  float time = 0;          ///< time of animated surfaces [s]
  /// Number of the object in the RayScene, and of the triangle in its mesh.
  unsigned object = 0, triangle = 0;
  Vector3f object_position = Vector3f::Zero();  ///< position in the object's frame, for patterns
  Vector3f object_normal = Vector3f::Zero();
  const Eigen::Affine3f* world_from_object = nullptr;              ///< null for cloths and balls
  std::array<Vector2f, 2> uvs = {Vector2f(0, 0), Vector2f(0, 0)};  ///< both sets of texture coordinates
  Vector4f color = {1, 1, 1, 1};                                   ///< interpolated colour of the vertices
  Vector3f direction = Vector3f::Zero();                           ///< unit direction of the ray
  /// Directions of X and Y of a normal map, or of u and against v on a cloth with relief; zero without
  /// texture coordinates.
  Vector3f along_u = Vector3f::Zero(), against_v = Vector3f::Zero();

  /// Tilts the normal if it faces away from a direction. Smooth normals and relief can do so at outlines.
  void turn_normal_to(const Vector3f& view) {
    const float towards = normal.dot(view);
    if (towards < 0.02f) normal = (normal + (0.02f - towards) * view).normalized();
  }
};

class RayScene {
 public:
  RayScene();
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// Removes all objects. `time`: of animated surfaces such as ripples [s].
  void clear(float time = 0);
  /// Adds a mesh and returns the object's number. `mesh` and `material` must stay in memory until clear().
  /// `focuses`: whether the object is glass that focuses light; see Focus.
  unsigned add(const RayMesh& mesh, const RayMaterial& material, const Eigen::Affine3f& world_from_mesh,
               bool casts_shadow, bool focuses = false);
  static constexpr unsigned kNone = ~0u;  ///< returned in place of a number if the mesh has no triangles
  /// Adds a cloth. The lists must stay in memory until clear(). Positions must be finite. `texture_from_uv`:
  /// factors from ClothVertex::uv to texture coordinates.
  void add_cloth(std::span<const ClothVertex> vertices, std::span<const uint32_t> indices,
                 const RayMaterial& material, const Vector2f& texture_from_uv, bool casts_shadow);
  /// Adds `count` balls. `balls` points to the position and radius (w) of the first ball, `colors` to its
  /// colour. The values of the next ball follow after `stride` bytes.
  void add_balls(const Vector4f* balls, const Vector4f* colors, std::size_t stride, std::size_t count,
                 const RayMaterial& material, bool casts_shadow);
  /// Adds soft discs that face every ray. They only cast shadows. Arguments as for add_balls(); `softness`:
  /// see PointsDef.
  void add_sprites(const Vector4f* balls, const Vector4f* colors, std::size_t stride, std::size_t count,
                   float softness);
  /// Builds the hierarchy of all objects. Must be called before rays are traced.
  void build();

  bool empty() const { return objects_.empty(); }
  /// How shadow rays treat objects that focus light. `passes`: light passes in a straight line, which is an
  /// approximation. `blocks`: the object blocks light, because its refracted light is added as caustics.
  enum class Focus { passes, blocks };
  /// Returns the transmittance of a segment per channel: 0 behind an opaque object, otherwise the product of
  /// the transmittances of the translucent objects. `direction` is a unit vector; `length` [m].
  Vector3f transmittance(const Vector3f& from, const Vector3f& direction, float length,
                         Focus focus = Focus::passes) const;
  /// Returns the transmittances of eight segments. Only segments whose `active` is -1 are traced; the others
  /// get 0.
  LaneVectors transmittance(const LaneVectors& from, const LaneVectors& direction, Lanes length,
                            IntLanes active, Focus focus = Focus::passes) const;
  /// Finds the first hit of a ray. Returns false if the ray hits nothing within `length` [m].
  bool first_hit(const Vector3f& from, const Vector3f& direction, float length, Hit& hit) const;
  /// Finds the first hit of a ray that belongs to a picture: the ray passes through the backs that the
  /// shaders do not draw; see RayMaterial::hides_back.
  bool first_seen(const Vector3f& from, const Vector3f& direction, float length, Hit& hit) const;
  /// Moves the point `place` of a mesh, which is visible from `eye`, onto the curved surface that the smooth
  /// normals of its triangle describe (J. Hanika, "Hacking the Shadow Terminator", 2021). Returns points of
  /// other objects unchanged.
  Vector3f smooth_place(const Vector3f& eye, const Vector3f& place) const;
  /// The same for the point that a ray hit.
  Vector3f smooth_place(const Hit& hit) const;

 private:
  struct Object;
  const Object* first_object(RTCRayHit& ray) const;
  Vector3f through_translucent(const Vector3f& from, const Vector3f& direction, float length) const;
  unsigned attach(RTCGeometryTy* geometry, Object object, bool casts_shadow, bool focuses = false);

  std::vector<Object> objects_;  ///< objects by Embree's geometry id
  std::vector<RayTree> cloth_trees_;
  RayTree tree_;
  bool has_translucent_ = false;
  float time_ = 0;
};

// Distances by which off_surface() moves a point, relative to its largest coordinate and at least. The error
// of a point in single precision is a few units in the last place of its coordinates.
inline constexpr float kUnitsOffSurface = 32 * std::numeric_limits<float>::epsilon();
inline constexpr float kLeastOffSurface_m = 1e-7f;

/// Returns the origin of a ray from a point of a surface. It is moved off the surface, so that rounding does
/// not make the ray hit that surface. `face`: unit normal of the triangle, on the side of the ray.
inline Vector3f off_surface(const Vector3f& position, const Vector3f& face) {
  return position + face * (kUnitsOffSurface * position.cwiseAbs().maxCoeff() + kLeastOffSurface_m);
}

}  // namespace offstage::render
