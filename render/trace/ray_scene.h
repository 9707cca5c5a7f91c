#pragma once
/// Private: the scene as light rays see it: triangles and balls with their materials, in bounding volume
/// hierarchies by Embree. Embree only selects the object and the triangle; the point that is hit is computed
/// here, so that its bits do not depend on Embree's version.

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "render/cloth_surface.h"
#include "render/lanes.h"
#include "render/model.h"
#include "render/trace/ray_material.h"

struct RTCSceneTy;
struct RTCGeometryTy;
struct RTCRayHit;

namespace offstage::render {

struct DeleteRayTree {
  void operator()(RTCSceneTy* tree) const;
};
using RayTree = std::unique_ptr<RTCSceneTy, DeleteRayTree>;

/// Version of Embree and its instruction set, for example "Embree 3.13.5 avx2".
std::string ray_library();

/// A mesh with its hierarchy, which is built on first use.
class RayMesh {
 public:
  /// Copies the data that rays need. `normals`: as many as positions.
  RayMesh(const Mesh& mesh, const std::vector<Vector3f>& normals);
  RTCSceneTy* tree() const;
  /// Corners of a triangle in the world.
  std::array<Vector3f, 3> corners(unsigned triangle, const Eigen::Affine3f& world_from_mesh) const;
  /// Texture coordinates at the barycentric coordinates of the second and third corner.
  Vector2f uv_at(unsigned triangle, const Vector2f& barycentric) const;
  /// Area of all triangles, in the mesh's own units.
  float area() const;
  /// Chooses a triangle by a number in [0, 1), with a probability in proportion to its area; chance_of()
  /// returns this probability.
  unsigned triangle_at(float choice) const;
  float chance_of(unsigned triangle) const;

  std::vector<Vector4f> positions;  ///< w is not used; Embree reads 16 bytes
  std::vector<Vector3f> normals;
  std::vector<Vector2f> uvs;     ///< empty: none
  std::vector<Vector4f> colors;  ///< empty: none
  std::vector<uint32_t> indices;

 private:
  const std::vector<float>& areas() const;
  mutable RayTree tree_;
  mutable std::vector<float> area_up_to_;  ///< sums over the triangles; computed on first use
};

/// The first hit of a ray.
struct Hit {
  float distance = 0;  ///< distance along the ray [m]
  Vector3f position = Vector3f::Zero();
  Vector3f normal = Vector3f::Zero();  ///< smooth, on the side of the ray's origin
  Vector3f face = Vector3f::Zero();    ///< unit normal of the triangle, on the side of the ray's origin
  bool front = true;
  const RayMaterial* material = nullptr;
  float translucency = 0;  ///< translucency of a cloth, else 0
  /// Number of the object in the scene, and of the triangle in its mesh.
  unsigned object = 0, triangle = 0;
  Vector3f object_position = Vector3f::Zero();  ///< position in the object's frame, for patterns
  Vector3f object_normal = Vector3f::Zero();
  Vector2f uv = {0, 0};
  Vector4f color = {1, 1, 1, 1};  ///< interpolated colour of the vertices
};

class RayScene {
 public:
  RayScene();
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// Removes all objects.
  void clear();
  /// Returns the object's number. The mesh and the material must stay in memory until clear().
  /// `focuses`: the light of the sun that it refracts is traced, see Focus.
  unsigned add(const RayMesh& mesh, const RayMaterial& material, const Eigen::Affine3f& world_from_mesh,
               bool casts_shadow, bool focuses = false);
  static constexpr unsigned kNone = ~0u;  ///< returned in place of a number if the mesh has no triangles
  /// The lists must stay in memory until clear(). Positions must be finite.
  void add_cloth(std::span<const ClothVertex> vertices, std::span<const uint32_t> indices,
                 const RayMaterial& material, const Vector2f& texture_from_uv, bool casts_shadow);
  /// Adds `count` balls. `balls` points to the position and radius of the first one, `colors` to its colour;
  /// those of the next ball follow after `stride` bytes.
  void add_balls(const Vector4f* balls, const Vector4f* colors, std::size_t stride, std::size_t count,
                 const RayMaterial& material, bool casts_shadow);
  /// Soft discs that face every ray, and only cast shadows.
  void add_sprites(const Vector4f* balls, const Vector4f* colors, std::size_t stride, std::size_t count,
                   float softness);
  /// Builds the hierarchy over all objects.
  void build();

  bool empty() const { return objects_.empty(); }
  /// Whether the objects that focus light let it pass straight through, as an approximation, or block it,
  /// because their refracted light is added.
  enum class Focus { passes, blocks };
  /// Fraction of the light that arrives along a segment: 0 behind an opaque object, and the product of the
  /// transmittances of translucent ones. `direction` is a unit vector.
  Vector3f transmittance(const Vector3f& from, const Vector3f& direction, float length,
                         Focus focus = Focus::passes) const;
  /// Fractions of the light that arrives along eight segments. Only those whose `active` is -1 are computed;
  /// the others get 0.
  LaneVectors transmittance(const LaneVectors& from, const LaneVectors& direction, Lanes length,
                            IntLanes active, Focus focus = Focus::passes) const;
  /// Returns false if the ray meets nothing within `length` [m].
  bool first_hit(const Vector3f& from, const Vector3f& direction, float length, Hit& hit) const;
  /// The point `place` of a mesh that is visible from `eye`, moved onto the surface that its smooth normals
  /// suggest (J. Hanika, "Hacking the Shadow Terminator", 2021). Other points stay.
  Vector3f smooth_place(const Vector3f& eye, const Vector3f& place) const;

 private:
  struct Object;
  const Object* first_object(RTCRayHit& ray) const;
  Vector3f through_translucent(const Vector3f& from, const Vector3f& direction, float length) const;
  unsigned attach(RTCGeometryTy* geometry, Object object, bool casts_shadow, bool focuses = false);

  std::vector<Object> objects_;  ///< objects by Embree's geometry id
  std::vector<RayTree> cloth_trees_;
  RayTree tree_;
  bool has_translucent_ = false;
};

// A point computed in single precision is off by a few units in the last place of its coordinates.
inline constexpr float kUnitsOffSurface = 32 * std::numeric_limits<float>::epsilon();
inline constexpr float kLeastOffSurface_m = 1e-7f;

/// A point moved off the surface so that a ray from there does not meet the surface itself because of
/// rounding. `face`: unit normal on the side of the ray.
inline Vector3f off_surface(const Vector3f& position, const Vector3f& face) {
  return position + face * (kUnitsOffSurface * position.cwiseAbs().maxCoeff() + kLeastOffSurface_m);
}

}  // namespace offstage::render
