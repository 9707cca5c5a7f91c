#include "render/trace/ray_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>

#include "render/trace/embree.h"

namespace offstage::render {
namespace {

// Groups of objects that a ray can ignore.
constexpr unsigned kOpaqueCaster = 1, kTranslucentCaster = 2, kFocusingCaster = 4, kNoCaster = 8, kAll = 15,
                   kSprite = 16;
// The groups of objects that reduce the light along a shadow ray.
constexpr unsigned kDimming = kTranslucentCaster | kFocusingCaster | kSprite;

/// Returns the groups of objects that block a shadow ray.
constexpr unsigned blocking(RayScene::Focus focus) {
  return focus == RayScene::Focus::blocks ? kOpaqueCaster | kFocusingCaster : kOpaqueCaster;
}

// Largest number of translucent surfaces and sprites that a shadow ray is tested against; light passes the
// others freely.
constexpr int kMostPassed = 64;
constexpr int kMostHidden = 64;  // largest number of hidden backs that a ray of a picture passes

RTCGeometry make_triangles(const void* positions, std::size_t stride, std::size_t count,
                           std::span<const uint32_t> indices) {
  RTCGeometry geometry = embree::make_geometry(RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions, 0, stride,
                             count);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, indices.data(), 0,
                             3 * sizeof(uint32_t), indices.size() / 3);
  return geometry;
}

/// Returns the barycentric coordinates, for the corners b and c, of the point where a ray meets the plane of
/// a triangle. They are clamped to the triangle.
Vector2f barycentric(const Vector3f& from, const Vector3f& direction, const Vector3f& a, const Vector3f& b,
                     const Vector3f& c) {
  const Vector3f ab = b - a, ac = c - a, p = direction.cross(ac);
  const float determinant = ab.dot(p);
  if (determinant == 0) return {1.0f / 3, 1.0f / 3};
  const Vector3f s = from - a;
  float u = std::clamp(s.dot(p) / determinant, 0.0f, 1.0f);
  float v = std::clamp(direction.dot(s.cross(ab)) / determinant, 0.0f, 1.0f);
  if (u + v > 1) {
    const float sum = u + v;
    u /= sum;
    v /= sum;
  }
  return {u, v};
}

/// Sets the directions of a normal map from the gradients of the texture coordinates on a triangle. `ab`,
/// `ac`: edges of the triangle; `uv_ab`, `uv_ac`: changes of the coordinates along them.
void set_gradients(const Vector3f& ab, const Vector3f& ac, const Vector2f& uv_ab, const Vector2f& uv_ac,
                   Hit& hit) {
  const float side = hit.normal.dot(ab.cross(ac)) < 0 ? -1.0f : 1.0f;
  const Vector3f a = side * ac.cross(hit.normal), b = side * hit.normal.cross(ab);
  hit.along_u = a * uv_ab.x() + b * uv_ac.x();
  hit.against_v = -(a * uv_ab.y() + b * uv_ac.y());
  const float size =
      1 / std::sqrt(std::max({hit.along_u.squaredNorm(), hit.against_v.squaredNorm(), 1e-30f}));
  hit.along_u *= size;
  hit.against_v *= size;
}

template <class T>
T mixed(const T& a, const T& b, const T& c, const Vector2f& uv) {
  return (1 - uv.x() - uv.y()) * a + uv.x() * b + uv.y() * c;
}

}  // namespace

std::string ray_library() {
  const auto version = rtcGetDeviceProperty(embree::device(), RTC_DEVICE_PROPERTY_VERSION);
  return "Embree " + std::to_string(version / 10000) + "." + std::to_string(version / 100 % 100) + "." +
         std::to_string(version % 100) + " avx2";
}

RayMesh::RayMesh(const Mesh& mesh, const std::vector<Vector3f>& mesh_normals)
    : normals(mesh_normals),
      uvs(mesh.uvs),
      second_uvs(mesh.second_uvs),
      tangents(mesh.tangents),
      colors(mesh.colors),
      indices(mesh.indices) {
  positions.reserve(mesh.positions.size());
  for (const Vector3f& p : mesh.positions) positions.push_back({p.x(), p.y(), p.z(), 0});
}

RTCSceneTy* RayMesh::tree() const {
  if (!tree_) {
    tree_ = embree::make_tree(RTC_BUILD_QUALITY_MEDIUM);
    embree::attach(tree_.get(),
                   make_triangles(positions.data(), sizeof(Vector4f), positions.size(), indices));
    rtcCommitScene(tree_.get());
  }
  return tree_.get();
}

std::array<Vector3f, 3> RayMesh::corners(unsigned triangle, const Eigen::Affine3f& world_from_mesh) const {
  std::array<Vector3f, 3> result;
  for (std::size_t i = 0; i < 3; ++i)
    result[i] = world_from_mesh * positions[indices[3 * std::size_t{triangle} + i]].head<3>();
  return result;
}

std::array<Vector2f, 2> RayMesh::uvs_at(unsigned triangle, const Vector2f& barycentric) const {
  const uint32_t* k = &indices[3 * std::size_t{triangle}];
  const auto at = [&](const std::vector<Vector2f>& set) -> Vector2f {
    if (set.empty()) return {0, 0};
    return mixed(set[k[0]], set[k[1]], set[k[2]], barycentric);
  };
  return {at(uvs), at(second_uvs)};
}

const Vector2f& RayMesh::uv_of(std::size_t vertex, int set) const {
  static const Vector2f none(0, 0);
  const std::vector<Vector2f>& of_set = set == 1 ? second_uvs : uvs;
  return of_set.empty() ? none : of_set[vertex];
}

bool RayMesh::is_plate() const {
  constexpr double kLeastFraction = 0.9;  // of the area
  constexpr double kParallel = 0.999;     // least cosine between two normals
  constexpr double kThin = 0.05;          // greatest thickness, in square roots of the area of one side
  if (is_plate_) return *is_plate_;
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  // area of the largest triangle
  double all = 0, parallel = 0;
  const auto area_of = [this](unsigned triangle) -> Eigen::Vector3d {
    const std::array<Vector3f, 3> p = corners(triangle, Eigen::Affine3f::Identity());
    return (p[1] - p[0]).cross(p[2] - p[0]).cast<double>();
  };
  const auto count = static_cast<unsigned>(indices.size() / 3);
  for (unsigned t = 0; t < count; ++t)
    if (const Eigen::Vector3d area = area_of(t); area.squaredNorm() > axis.squaredNorm()) axis = area;
  axis.normalize();
  for (unsigned t = 0; t < count; ++t) {
    const Eigen::Vector3d area = area_of(t);
    all += area.norm();
    if (std::abs(area.dot(axis)) > kParallel * area.norm()) parallel += area.norm();
  }
  double low = 0, high = 0;  // along the axis, from the first vertex
  for (const Vector4f& p : positions) {
    const double height = axis.dot((p - positions.front()).head<3>().cast<double>());
    low = std::min(low, height);
    high = std::max(high, height);
  }
  // The areas are those of parallelograms, and both sides count.
  is_plate_ = parallel >= kLeastFraction * all && high - low <= kThin * std::sqrt(parallel / 4);
  return *is_plate_;
}

const std::vector<float>& RayMesh::areas() const {
  if (area_up_to_.empty()) {
    double sum = 0;
    for (unsigned t = 0; 3 * std::size_t{t} + 2 < indices.size(); ++t) {
      const std::array<Vector3f, 3> p = corners(t, Eigen::Affine3f::Identity());
      sum += 0.5 * static_cast<double>((p[1] - p[0]).cross(p[2] - p[0]).norm());
      area_up_to_.push_back(static_cast<float>(sum));
    }
  }
  return area_up_to_;
}

float RayMesh::area() const {
  return areas().empty() ? 0 : areas().back();
}

unsigned RayMesh::triangle_at(float choice) const {
  const std::vector<float>& up_to = areas();
  const auto found = std::ranges::upper_bound(up_to, choice * up_to.back());
  return static_cast<unsigned>(std::min(found - up_to.begin(), std::ssize(up_to) - 1));
}

float RayMesh::chance_of(unsigned triangle) const {
  const std::vector<float>& up_to = areas();
  return (up_to[triangle] - (triangle > 0 ? up_to[triangle - 1] : 0)) / up_to.back();
}

struct RayScene::Object {
  const RayMaterial* material = nullptr;
  const RayMesh* mesh = nullptr;  ///< the mesh; null: the object is a cloth or balls
  Eigen::Affine3f world_from_mesh = Eigen::Affine3f::Identity();
  Eigen::Matrix3f normal_from_mesh = Eigen::Matrix3f::Identity();
  bool mirrored = false;
  std::span<const ClothVertex> vertices = {};
  std::span<const uint32_t> indices = {};
  Vector2f texture_from_uv = {1, 1};
  const std::byte* balls = nullptr;
  const std::byte* colors = nullptr;
  std::size_t stride = 0;
  float softness = -1;  ///< softness of sprites; negative: the object is not a set of sprites

  /// Returns the fraction of the light that passes a sprite along a ray; `behind`: distance of the far side
  /// of its ball.
  float transmittance(unsigned sprite, const Vector3f& from, const Vector3f& direction, float& behind) const;
  /// Returns the point at which a ray hits a triangle of a mesh, moved to the smooth surface that the vertex
  /// normals suggest.
  Vector3f smoothed(unsigned triangle, const Vector3f& from, const Vector3f& direction) const;
  void describe(unsigned triangle, const Vector3f& from, const Vector3f& direction, Hit& hit) const;

 private:
  void describe_mesh(unsigned triangle, const Vector3f& from, const Vector3f& direction, Hit& hit) const;
  void describe_tangents(const TextureMap& map, unsigned triangle, const std::array<Vector3f, 3>& corners,
                         const Vector2f& barycentric, Hit& hit) const;
  void describe_cloth(unsigned triangle, const Vector3f& from, const Vector3f& direction, Hit& hit) const;
  void describe_ball(unsigned ball, const Vector3f& from, const Vector3f& direction, Hit& hit) const;
};

RayScene::RayScene() = default;
RayScene::~RayScene() = default;

void RayScene::clear(float time) {
  time_ = time;
  objects_.clear();
  cloth_trees_.clear();
  tree_ = embree::make_tree(RTC_BUILD_QUALITY_LOW);
  has_translucent_ = false;
}

unsigned RayScene::attach(RTCGeometryTy* geometry, Object object, bool casts_shadow, bool focuses) {
  const bool solid = object.material->is_opaque();
  rtcSetGeometryMask(geometry, !casts_shadow ? kNoCaster
                               : solid       ? kOpaqueCaster
                               : focuses     ? kFocusingCaster
                                             : kTranslucentCaster);
  has_translucent_ = has_translucent_ || (casts_shadow && !solid);
  const unsigned id = embree::attach(tree_.get(), geometry);
  if (objects_.size() <= id) objects_.resize(id + 1);
  objects_[id] = std::move(object);
  return id;
}

unsigned RayScene::add(const RayMesh& mesh, const RayMaterial& material,
                       const Eigen::Affine3f& world_from_mesh, bool casts_shadow, bool focuses) {
  if (mesh.indices.empty() || !world_from_mesh.matrix().allFinite()) return kNone;
  const float determinant = world_from_mesh.linear().determinant();
  if (determinant == 0) return kNone;
  RTCGeometry geometry = embree::make_geometry(RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(geometry, mesh.tree());
  rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR, world_from_mesh.matrix().data());
  Object object{.material = &material, .mesh = &mesh, .world_from_mesh = world_from_mesh};
  object.normal_from_mesh = world_from_mesh.linear().inverse().transpose();
  object.mirrored = determinant < 0;
  return attach(geometry, std::move(object), casts_shadow, focuses);
}

void RayScene::add_cloth(std::span<const ClothVertex> vertices, std::span<const uint32_t> indices,
                         const RayMaterial& material, const Vector2f& texture_from_uv, bool casts_shadow) {
  if (vertices.empty() || indices.empty()) return;
  RTCGeometry geometry = make_triangles(&vertices[0].position, sizeof(ClothVertex), vertices.size(), indices);
  attach(
      geometry,
      {.material = &material, .vertices = vertices, .indices = indices, .texture_from_uv = texture_from_uv},
      casts_shadow);
}

void RayScene::add_balls(const Vector4f* balls, const Vector4f* colors, std::size_t stride, std::size_t count,
                         const RayMaterial& material, bool casts_shadow) {
  if (count == 0) return;
  RTCGeometry geometry = embree::make_geometry(RTC_GEOMETRY_TYPE_SPHERE_POINT);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, balls, 0, stride, count);
  attach(geometry,
         {.material = &material,
          .balls = reinterpret_cast<const std::byte*>(balls),
          .colors = reinterpret_cast<const std::byte*>(colors),
          .stride = stride},
         casts_shadow);
}

void RayScene::add_sprites(const Vector4f* balls, const Vector4f* colors, std::size_t stride,
                           std::size_t count, float softness) {
  if (count == 0) return;
  RTCGeometry geometry = embree::make_geometry(RTC_GEOMETRY_TYPE_SPHERE_POINT);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, balls, 0, stride, count);
  rtcSetGeometryMask(geometry, kSprite);
  has_translucent_ = true;
  const unsigned id = embree::attach(tree_.get(), geometry);
  if (objects_.size() <= id) objects_.resize(id + 1);
  objects_[id] = {.balls = reinterpret_cast<const std::byte*>(balls),
                  .colors = reinterpret_cast<const std::byte*>(colors),
                  .stride = stride,
                  .softness = std::clamp(softness, 0.01f, 1.0f)};
}

void RayScene::build() {
  rtcCommitScene(tree_.get());
}

void RayScene::Object::describe(unsigned triangle, const Vector3f& from, const Vector3f& direction,
                                Hit& hit) const {
  hit.material = material;
  if (mesh != nullptr)
    describe_mesh(triangle, from, direction, hit);
  else if (balls != nullptr)
    describe_ball(triangle, from, direction, hit);
  else
    describe_cloth(triangle, from, direction, hit);
  hit.distance = direction.dot(hit.position - from);
  hit.front = hit.face.dot(direction) <= 0;
  if (!hit.front) hit.face = -hit.face;
  if (hit.normal.dot(hit.face) < 0) hit.normal = -hit.normal;
  hit.turn_normal_to(-direction);
  hit.direction = direction;
}

void RayScene::Object::describe_mesh(unsigned triangle, const Vector3f& from, const Vector3f& direction,
                                     Hit& hit) const {
  std::array<std::size_t, 3> k;
  for (std::size_t i = 0; i < 3; ++i) k[i] = mesh->indices[3 * std::size_t{triangle} + i];
  std::array<Vector3f, 3> local;
  for (std::size_t i = 0; i < 3; ++i) local[i] = mesh->positions[k[i]].head<3>();
  const std::array<Vector3f, 3> p = mesh->corners(triangle, world_from_mesh);
  const Vector2f uv = barycentric(from, direction, p[0], p[1], p[2]);
  hit.position = mixed(p[0], p[1], p[2], uv);
  hit.face = (p[1] - p[0]).cross(p[2] - p[0]).normalized() * (mirrored ? -1.0f : 1.0f);
  hit.object_position = mixed(local[0], local[1], local[2], uv);
  hit.object_normal = mixed(mesh->normals[k[0]], mesh->normals[k[1]], mesh->normals[k[2]], uv);
  hit.normal = (normal_from_mesh * hit.object_normal).normalized();
  if (!hit.normal.allFinite()) hit.normal = hit.face;
  hit.world_from_object = &world_from_mesh;
  hit.uvs = mesh->uvs_at(triangle, uv);
  if (const TextureMap* map = material->normal_map()) describe_tangents(*map, triangle, p, uv, hit);
  if (!mesh->colors.empty() && material->vertex_colors)
    hit.color = mixed(mesh->colors[k[0]], mesh->colors[k[1]], mesh->colors[k[2]], uv);
}

// Computes the directions of a normal map in the same way as mapped_normal() in shaders/mesh.frag. Without
// given tangents, they are the gradients of the texture coordinates on the surface.
void RayScene::Object::describe_tangents(const TextureMap& map, unsigned triangle,
                                         const std::array<Vector3f, 3>& corners, const Vector2f& barycentric,
                                         Hit& hit) const {
  std::array<std::size_t, 3> k;
  for (std::size_t i = 0; i < 3; ++i) k[i] = mesh->indices[3 * std::size_t{triangle} + i];
  const Vector3f n = hit.normal;
  if (!mesh->tangents.empty()) {
    const std::vector<Vector4f>& all = mesh->tangents;
    const Vector4f tangent = mixed(all[k[0]], all[k[1]], all[k[2]], barycentric);
    const Vector3f t = world_from_mesh.linear() * tangent.head<3>();
    if (t.squaredNorm() > 1e-6f) {
      hit.along_u = (t - n * n.dot(t)).normalized();
      hit.against_v = ((tangent.w() < 0) != mirrored ? -1.0f : 1.0f) * n.cross(hit.along_u);
      return;
    }
  }
  const Vector3f ab = corners[1] - corners[0], ac = corners[2] - corners[0];
  const auto place = [&](std::size_t i) -> Vector2f {
    const Vector3f uv = mesh->uv_of(k[i], map.uv_set).homogeneous();
    return {map.rows[0].dot(uv), map.rows[1].dot(uv)};
  };
  set_gradients(ab, ac, place(1) - place(0), place(2) - place(0), hit);
}

// The result is the mean of three projections of the point, onto the planes through the corners that are
// perpendicular to the normals of the corners.
Vector3f RayScene::Object::smoothed(unsigned triangle, const Vector3f& from,
                                    const Vector3f& direction) const {
  std::array<Vector3f, 3> p = mesh->corners(triangle, world_from_mesh), n;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t k = mesh->indices[3 * std::size_t{triangle} + i];
    n[i] = (normal_from_mesh * mesh->normals[k]).normalized();
  }
  const Vector2f uv = barycentric(from, direction, p[0], p[1], p[2]);
  const Vector3f place = mixed(p[0], p[1], p[2], uv);
  const float side = mixed(n[0], n[1], n[2], uv).dot(direction) > 0 ? -1.0f : 1.0f;
  for (std::size_t i = 0; i < 3; ++i) {
    n[i] *= side;
    p[i] = place - std::min(n[i].dot(place - p[i]), 0.0f) * n[i];
  }
  const Vector3f result = mixed(p[0], p[1], p[2], uv);
  if (!result.allFinite()) return place;
  return off_surface(result, side * mixed(n[0], n[1], n[2], uv).normalized());
}

void RayScene::Object::describe_cloth(unsigned triangle, const Vector3f& from, const Vector3f& direction,
                                      Hit& hit) const {
  const std::size_t first = 3 * std::size_t{triangle};
  const ClothVertex &a = vertices[indices[first]], &b = vertices[indices[first + 1]],
                    &c = vertices[indices[first + 2]];
  const Vector2f uv = barycentric(from, direction, a.position, b.position, c.position);
  hit.position = mixed(a.position, b.position, c.position, uv);
  hit.face = (b.position - a.position).cross(c.position - a.position).normalized();
  hit.normal = mixed(a.normal, b.normal, c.normal, uv).normalized();
  if (!hit.normal.allFinite()) hit.normal = hit.face;
  hit.is_cloth = true;
  hit.translucency = material->translucency;
  const Vector2f along = mixed(a.uv, b.uv, c.uv, uv);
  hit.object_position = {along.x(), along.y(), 0};
  hit.object_normal = Vector3f::UnitZ();
  hit.uvs[0] = hit.uvs[1] = along.cwiseProduct(texture_from_uv);
  if (material->has_relief() || material->has_threads())
    set_gradients(b.position - a.position, c.position - a.position, b.uv - a.uv, c.uv - a.uv, hit);
}

void RayScene::Object::describe_ball(unsigned ball, const Vector3f& from, const Vector3f& direction,
                                     Hit& hit) const {
  const Vector4f& place = *reinterpret_cast<const Vector4f*>(balls + ball * stride);
  const Vector3f center = place.head<3>(), to_center = center - from;
  const float along = to_center.dot(direction);
  const Vector3f across = to_center - along * direction;
  const float half = std::sqrt(std::max(place.w() * place.w() - across.squaredNorm(), 0.0f));
  const float distance = along - half > 0 ? along - half : along + half;
  hit.face = (from + distance * direction - center).normalized();
  hit.position = center + place.w() * hit.face;
  hit.normal = hit.object_normal = hit.face;
  hit.object_position = hit.position - center;
  hit.color = *reinterpret_cast<const Vector4f*>(colors + ball * stride);
  hit.color.w() = 1;
}

// Equal to coverage() in shaders/points_shape.glsl.
float RayScene::Object::transmittance(unsigned sprite, const Vector3f& from, const Vector3f& direction,
                                      float& behind) const {
  const Vector4f& place = *reinterpret_cast<const Vector4f*>(balls + sprite * stride);
  const float opacity = std::min(reinterpret_cast<const Vector4f*>(colors + sprite * stride)->w(), 1.0f);
  const Vector3f to_center = place.head<3>() - from;
  const float along = to_center.dot(direction);
  const float across = (to_center - along * direction).norm() / place.w();
  behind = along + place.w() * std::sqrt(std::max(1 - across * across, 0.0f));
  const float x = std::clamp((across - 1 + softness) / softness, 0.0f, 1.0f);
  return 1 - opacity * (1 - x * x * (3 - 2 * x));
}

const RayScene::Object* RayScene::first_object(RTCRayHit& ray) const {
  ray.hit.geomID = ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  embree::intersect(tree_.get(), ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return nullptr;
  return &objects_[ray.hit.instID[0] != RTC_INVALID_GEOMETRY_ID ? ray.hit.instID[0] : ray.hit.geomID];
}

bool RayScene::first_hit(const Vector3f& from, const Vector3f& direction, float length, Hit& hit) const {
  RTCRayHit ray;
  embree::set_ray(ray.ray, from, direction, length, kAll);
  const Object* object = first_object(ray);
  if (object == nullptr) return false;
  hit = {};
  hit.object = static_cast<unsigned>(object - objects_.data());
  hit.triangle = ray.hit.primID;
  hit.time = time_;
  object->describe(ray.hit.primID, from, direction, hit);
  return true;
}

bool RayScene::first_seen(const Vector3f& from, const Vector3f& direction, float length, Hit& hit) const {
  Vector3f place = from;
  for (int layer = 0; layer <= kMostHidden; ++layer) {
    if (!first_hit(place, direction, length, hit)) return false;
    const bool is_mesh = hit.world_from_object != nullptr;
    if (hit.front || !is_mesh || !hit.material->hides_back) break;
    length -= hit.distance;
    place = off_surface(hit.position, -hit.face);
  }
  hit.distance = direction.dot(hit.position - from);
  return true;
}

Vector3f RayScene::smooth_place(const Vector3f& eye, const Vector3f& place) const {
  const Vector3f offset = place - eye;
  const float length = offset.norm();
  RTCRayHit ray;
  embree::set_ray(ray.ray, eye, offset / length, 1.001f * length, kAll);
  const Object* object = first_object(ray);
  if (object == nullptr || object->mesh == nullptr || ray.ray.tfar < 0.999f * length) return place;
  return object->smoothed(ray.hit.primID, eye, offset / length);
}

Vector3f RayScene::smooth_place(const Hit& hit) const {
  const Object& object = objects_[hit.object];
  if (object.mesh == nullptr) return hit.position;
  return object.smoothed(hit.triangle, hit.position - hit.distance * hit.direction, hit.direction);
}

Vector3f RayScene::transmittance(const Vector3f& from, const Vector3f& direction, float length,
                                 Focus focus) const {
  RTCRay ray;
  embree::set_ray(ray, from, direction, length, blocking(focus));
  embree::occluded(tree_.get(), ray);
  if (ray.tfar < 0) return Vector3f::Zero();
  return through_translucent(from, direction, length);
}

namespace {

/// Returns which of eight segments meet an object of the given groups.
IntLanes blocked(RTCScene tree, const LaneVectors& from, const LaneVectors& direction, Lanes length,
                 IntLanes active, unsigned mask) {
  if (!any(active)) return IntLanes{};
  RTCRay8 rays;
  const auto store = [](auto* target, const auto& lanes) { std::memcpy(target, &lanes, sizeof(lanes)); };
  store(rays.org_x, from.x);
  store(rays.org_y, from.y);
  store(rays.org_z, from.z);
  store(rays.dir_x, direction.x);
  store(rays.dir_y, direction.y);
  store(rays.dir_z, direction.z);
  store(rays.tnear, Lanes{});
  store(rays.tfar, length);
  store(rays.time, Lanes{});
  store(rays.mask, UintLanes{} + mask);
  store(rays.id, UintLanes{});
  store(rays.flags, UintLanes{});
  alignas(32) std::array<int, kLanes> valid;
  store(valid.data(), active);
  embree::occluded(tree, valid, rays);
  Lanes far;
  std::memcpy(&far, rays.tfar, sizeof(far));
  return active & (far < 0.0f);
}

}  // namespace

LaneVectors RayScene::transmittance(const LaneVectors& from, const LaneVectors& direction, Lanes length,
                                    IntLanes active, Focus focus) const {
  const Lanes none{};
  const IntLanes free = active & ~blocked(tree_.get(), from, direction, length, active, blocking(focus));
  const Lanes open = free ? none + 1 : none;
  LaneVectors fraction{open, open, open};
  if (!has_translucent_) return fraction;
  const IntLanes dimmed = blocked(tree_.get(), from, direction, length, free, kDimming);
  for (int i = 0; i < kLanes; ++i) {
    if (!dimmed[i]) continue;
    const Vector3f one = through_translucent({from.x[i], from.y[i], from.z[i]},
                                             {direction.x[i], direction.y[i], direction.z[i]}, length[i]);
    fraction.x[i] = one.x();
    fraction.y[i] = one.y();
    fraction.z[i] = one.z();
  }
  return fraction;
}

Vector3f RayScene::through_translucent(const Vector3f& from, const Vector3f& direction, float length) const {
  Vector3f fraction = Vector3f::Ones(), place = from;
  for (int layer = 0; has_translucent_ && layer < kMostPassed && length > 0; ++layer) {
    RTCRayHit hit_ray;
    embree::set_ray(hit_ray.ray, place, direction, length, kDimming);
    const Object* object = first_object(hit_ray);
    if (object == nullptr) break;
    float advance = 0;
    if (object->softness >= 0) {
      fraction *= object->transmittance(hit_ray.hit.primID, place, direction, advance);
      advance = std::max(advance, 0.0f) + 1e-6f * place.cwiseAbs().maxCoeff() + 1e-7f;
      place += advance * direction;
    } else {
      Hit hit;
      object->describe(hit_ray.hit.primID, place, direction, hit);
      fraction = fraction.cwiseProduct(hit.material->transmittance(hit, direction));
      advance = std::max(hit.distance, 0.0f);
      place = off_surface(hit.position, -hit.face);
    }
    if (fraction.maxCoeff() < 1e-3f) return Vector3f::Zero();
    length -= advance;
  }
  return fraction;
}

}  // namespace offstage::render
