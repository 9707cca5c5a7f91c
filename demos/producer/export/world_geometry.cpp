#include "producer/export/world_geometry.h"

#include <array>

namespace offstage::producer {
namespace {

using Eigen::Affine3f;
using Eigen::Vector2f;
using Eigen::Vector3f;
using Eigen::Vector4f;

void begin_group(WorldGeometry& out, const std::string& object, uint32_t id, std::size_t material) {
  out.groups.push_back({object, material, id, out.positions.size(), 0, out.indices.size(), 0});
}

void end_group(WorldGeometry& out) {
  GeometryGroup& group = out.groups.back();
  group.vertices = out.positions.size() - group.first_vertex;
  group.indices = out.indices.size() - group.first_index;
}

/// Returns texture coordinates placed by the texture map of the base colour.
Vector2f placed(const Vector2f& uv, const render::Material& look) {
  if (look.triplanar) return uv;
  const std::array<Vector3f, 2>& rows = look.base_color_texture.rows;
  const Vector3f place(uv.x(), uv.y(), 1);
  return {rows[0].dot(place), rows[1].dot(place)};
}

void add_mesh(const render::Mesh& mesh, const render::Material& look, const Affine3f& world_from_mesh,
              WorldGeometry& out) {
  const auto base = static_cast<uint32_t>(out.positions.size());
  const Eigen::Matrix3f normal_matrix = world_from_mesh.linear().inverse().transpose();
  const std::vector<Vector2f>& uvs = look.base_color_texture.uv_set == 1 ? mesh.second_uvs : mesh.uvs;
  const bool has_colors = look.vertex_colors && !mesh.colors.empty();
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    out.positions.push_back(world_from_mesh * mesh.positions[i]);
    out.normals.push_back(mesh.normals.empty() ? Vector3f(Vector3f::UnitY())
                                               : Vector3f((normal_matrix * mesh.normals[i]).normalized()));
    out.uvs.push_back(uvs.empty() ? Vector2f(0, 0) : placed(uvs[i], look));
    out.colors.push_back(has_colors ? mesh.colors[i] : Vector4f(Vector4f::Ones()));
  }
  for (const uint32_t index : mesh.indices) out.indices.push_back(base + index);
}

void add_cloth(const FilmCloth& cloth, const render::Material& look, const ClothSample& sample,
               WorldGeometry& out) {
  const auto base = static_cast<uint32_t>(out.positions.size());
  const ClothSurface surface = cloth_surface(cloth, sample);
  out.positions.insert(out.positions.end(), sample.points.begin(), sample.points.end());
  out.normals.insert(out.normals.end(), surface.normals.begin(), surface.normals.end());
  for (const Vector2f& uv : surface.uvs) out.uvs.push_back(placed({uv.x(), 1 - uv.y()}, look));
  out.colors.resize(out.positions.size(), Vector4f::Ones());
  for (const uint32_t index : *surface.triangles) out.indices.push_back(base + index);
}

}  // namespace

WorldGeometry world_geometry(const FilmParts& parts, const Snapshot& snapshot) {
  WorldGeometry out;
  uint32_t id = 0;
  for (const FilmBody& body : parts.bodies) {
    ++id;
    if (!body.lifetime.contains(snapshot.time)) continue;
    const BodySample& s = body.slot ? snapshot.bodies[*body.slot] : body.place;
    const Affine3f world_from_body = Eigen::Translation3f(s.position) * s.orientation;
    for (const FilmPart& part : body.parts) {
      begin_group(out, body.name, id, part.material);
      add_mesh(parts.meshes[part.mesh], parts.materials[part.material].look,
               world_from_body * part.body_from_part, out);
      end_group(out);
    }
  }
  for (const FilmRod& rod : parts.rods) {
    ++id;
    const std::optional<Affine3f> place = rod_transform(snapshot.rods[rod.rod]);
    if (!place) continue;
    begin_group(out, rod.name, id, rod.material);
    add_mesh(parts.meshes[rod.mesh], parts.materials[rod.material].look, *place, out);
    end_group(out);
  }
  for (const FilmCloth& cloth : parts.cloths) {
    ++id;
    if (!cloth.lifetime.contains(snapshot.time)) continue;
    begin_group(out, cloth.name, id, cloth.material);
    add_cloth(cloth, parts.materials[cloth.material].look, snapshot.cloths[cloth.cloth], out);
    end_group(out);
  }
  for (const FilmPoints& points : parts.points)
    out.particles.push_back({points.name, ++id, &snapshot.point_sets[points.set]});
  return out;
}

}  // namespace offstage::producer
