#include "producer/export/world_geometry.h"

namespace offstage::producer {
namespace {

using Eigen::Affine3f;
using Eigen::Vector3f;

void begin_group(WorldGeometry& out, const std::string& object, uint32_t id, std::size_t material) {
  out.groups.push_back({object, material, id, out.positions.size(), 0, out.indices.size(), 0});
}

void end_group(WorldGeometry& out) {
  GeometryGroup& group = out.groups.back();
  group.vertices = out.positions.size() - group.first_vertex;
  group.indices = out.indices.size() - group.first_index;
}

void add_mesh(const render::Mesh& mesh, const Affine3f& world_from_mesh, WorldGeometry& out) {
  const auto base = static_cast<uint32_t>(out.positions.size());
  const Eigen::Matrix3f normal_matrix = world_from_mesh.linear().inverse().transpose();
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    out.positions.push_back(world_from_mesh * mesh.positions[i]);
    out.normals.push_back(mesh.normals.empty() ? Vector3f(Vector3f::UnitY())
                                               : Vector3f((normal_matrix * mesh.normals[i]).normalized()));
    out.uvs.push_back(mesh.uvs.empty() ? Eigen::Vector2f(0, 0) : mesh.uvs[i]);
  }
  for (const uint32_t index : mesh.indices) out.indices.push_back(base + index);
}

void add_cloth(const FilmCloth& cloth, const ClothSample& sample, WorldGeometry& out) {
  const auto base = static_cast<uint32_t>(out.positions.size());
  const ClothSurface surface = cloth_surface(cloth, sample);
  out.positions.insert(out.positions.end(), sample.points.begin(), sample.points.end());
  out.normals.insert(out.normals.end(), surface.normals.begin(), surface.normals.end());
  for (const Eigen::Vector2f& uv : surface.uvs) out.uvs.push_back({uv.x(), 1 - uv.y()});
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
      add_mesh(parts.meshes[part.mesh], world_from_body * part.body_from_part, out);
      end_group(out);
    }
  }
  for (const FilmRod& rod : parts.rods) {
    ++id;
    const std::optional<Affine3f> place = rod_transform(snapshot.rods[rod.rod]);
    if (!place) continue;
    begin_group(out, rod.name, id, rod.material);
    add_mesh(parts.meshes[rod.mesh], *place, out);
    end_group(out);
  }
  for (const FilmCloth& cloth : parts.cloths) {
    ++id;
    if (!cloth.lifetime.contains(snapshot.time)) continue;
    begin_group(out, cloth.name, id, cloth.material);
    add_cloth(cloth, snapshot.cloths[cloth.cloth], out);
    end_group(out);
  }
  for (const FilmPoints& points : parts.points)
    out.particles.push_back({points.name, ++id, &snapshot.point_sets[points.set]});
  return out;
}

}  // namespace offstage::producer
