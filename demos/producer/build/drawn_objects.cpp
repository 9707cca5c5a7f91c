#include "producer/build/drawn_objects.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "producer/base/to_float.h"
#include "producer/build/cloth_defs.h"
#include "render/primitives.h"

namespace offstage::producer {
namespace {

/// Half the length of an edge of the square that stands for an infinite plane [m]. Seen from a height of 300
/// m, the edge is so close to the horizon that it cannot be seen.
constexpr float kGroundHalfSize = 256'000;
constexpr float kGroundTexture_m = 2000;  // width of one copy of the plane's texture

}  // namespace

render::Mesh mesh_of(const sim::Sphere& s) {
  return render::make_sphere(to_float(s.radius));
}
render::Mesh mesh_of(const sim::Box& s, std::optional<Real> bevel) {
  return render::make_box(s.size.cast<float>(),
                          to_float(bevel.value_or(std::min(0.04 * s.size.minCoeff(), 0.05))));
}
render::Mesh mesh_of(const sim::Capsule& s) {
  return render::make_capsule(to_float(s.radius), to_float(s.height));
}
render::Mesh mesh_of(const sim::Cylinder& s) {
  return render::make_cylinder(to_float(s.radius), to_float(s.height));
}
render::Mesh mesh_of(const sim::Cone& s) {
  return render::make_cone(to_float(s.radius), to_float(s.height));
}
render::Mesh mesh_of(const sim::Frustum& s) {
  return render::make_frustum(to_float(s.radius), to_float(s.top_radius), to_float(s.height));
}
render::Mesh mesh_of(const sim::Ellipsoid& s) {
  return render::make_ellipsoid(s.radii.cast<float>());
}
render::Mesh mesh_of(const sim::Torus& s) {
  return render::make_torus(to_float(s.radius), to_float(s.tube_radius));
}
render::Mesh mesh_of(const sim::Tube& s) {
  return render::make_tube(to_float(s.radius), to_float(s.height), to_float(s.thickness));
}
render::Mesh mesh_of(const sim::OpenBox& s) {
  return render::make_open_box(s.size.cast<float>(), to_float(s.thickness));
}
render::Mesh mesh_of(const sim::Plane&) {
  render::Mesh ground = render::make_ground(kGroundHalfSize);
  for (Eigen::Vector2f& uv : ground.uvs)
    uv = (uv.array() - 0.5f) * (2 * kGroundHalfSize / kGroundTexture_m) + 0.5f;
  return ground;
}

render::Mesh mesh_of(const sim::ConvexPolyhedron& part) {
  const sim::TriangleMesh triangles = part.triangles();
  render::Mesh mesh;
  for (const Vec3& v : triangles.vertices) mesh.positions.push_back(v.cast<float>());
  for (const sim::Triangle& t : triangles.triangles)
    mesh.indices.insert(mesh.indices.end(), t.begin(), t.end());
  render::compute_normals(mesh, 20);
  return mesh;
}

namespace {

/// Returns the transform of texture coordinates that scales and turns a texture of this size.
std::array<Eigen::Vector3f, 2> texture_rows(const Material& material, const render::Image& image) {
  const float angle = to_float(material.texture_angle_deg) * std::numbers::pi_v<float> / 180;
  const float scale = 1 / to_float(material.texture_scale);
  const float c = scale * std::cos(angle), s = scale * std::sin(angle);
  // v points downwards, so the coordinates turn clockwise where the picture turns counter-clockwise.
  std::array<Eigen::Vector3f, 2> rows = {Eigen::Vector3f(c, -s, 0), Eigen::Vector3f(s, c, 0)};
  if (material.texture_projection == TextureProjection::triplanar) {
    rows[1] *= static_cast<float>(image.width_px) / static_cast<float>(image.height_px);
  } else {
    for (Eigen::Vector3f& row : rows) row.z() = 0.5f - 0.5f * (row.x() + row.y());
  }
  return rows;
}

}  // namespace

render::Material material_of(const Scene& scene, const std::string& name, const ModelLibrary& models,
                             std::vector<render::Image>& textures) {
  render::Material m;
  const auto it = std::ranges::find(scene.materials, name, &Material::name);
  if (it != scene.materials.end()) {
    m = {.name = it->name,
         .color = it->color.rgba,
         .metallic = to_float(it->metallic),
         .roughness = to_float(it->roughness),
         .emission = it->emission.rgb() * to_float(it->emission_strength),
         .transmission = to_float(it->transmission),
         .refraction = to_float(it->refraction),
         .pattern = it->pattern,
         .pattern_color = it->pattern_color.rgb(),
         .pattern_scale = to_float(it->pattern_scale),
         .two_sided = it->two_sided};
    if (!it->texture.empty()) {
      textures.push_back(models.texture(it->texture));
      m.base_color_texture.image = 0;
      m.base_color_texture.rows = texture_rows(*it, textures.back());
      m.triplanar = it->texture_projection == TextureProjection::triplanar;
    }
  }
  return m;
}

render::Material material_of(const Scene& scene, const Cloth& cloth, const ModelLibrary& models,
                             std::vector<render::Image>& textures) {
  render::Material m = fabric_look(cloth.fabric);
  const auto it = std::ranges::find(scene.materials, cloth.material, &Material::name);
  if (it == scene.materials.end()) return m;
  render::Fabric fabric = m.fabric;
  fabric.back_color
      .reset();  // the back colour suited the colour of the fabric, which the material has replaced
  if (const std::optional<FabricLook>& look = it->fabric) {
    fabric = {.weave = look->weave,
              .thread = to_float(look->thread),
              .relief = to_float(look->relief),
              .sheen = to_float(look->sheen),
              .sheen_color = look->sheen_color.rgb(),
              .translucency = to_float(look->translucency)};
    if (look->back_color) fabric.back_color = look->back_color->rgb();
  }
  m = material_of(scene, cloth.material, models, textures);
  m.fabric = fabric;
  return m;
}

}  // namespace offstage::producer
