// PLY (Stanford polygon format), binary little-endian: one file per frame. Surfaces are vertices with faces.
// Particles are vertices without faces.

#include <algorithm>
#include <bit>
#include <cmath>

#include <fmt/format.h>

#include "producer/export/export_notes.h"
#include "producer/export/film_export.h"
#include "producer/export/world_geometry.h"
#include "render/file_io.h"
#include "render/image_io.h"
#include "render/sink.h"
#include "render/tone_map.h"

namespace offstage::producer {
namespace {

static_assert(std::endian::native == std::endian::little);

/// Converts linear light to eight bits of sRGB, the usual encoding of vertex colours.
uint8_t srgb_byte(float linear) {
  return static_cast<uint8_t>(std::lround(255 * render::srgb_encode(std::clamp(linear, 0.f, 1.f))));
}

class PlyExport : public FilmExport {
 public:
  PlyExport(std::filesystem::path pattern, const FilmParts& parts)
      : pattern_(std::move(pattern)), parts_(parts) {}

  void write(const Snapshot& snapshot) override {
    const WorldGeometry geometry = world_geometry(parts_, snapshot);
    std::size_t particles = 0;
    for (const GeometryParticles& p : geometry.particles) particles += p.set->points.size();
    bytes_.clear();
    put_text(fmt::format(
        "ply\nformat binary_little_endian 1.0\ncomment {} frame {} time {} s\n"
        "comment object: number of the object; radius and id belong to particles, and are 0 for surfaces\n"
        "element vertex {}\n"
        "property float x\nproperty float y\nproperty float z\n"
        "property float nx\nproperty float ny\nproperty float nz\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n"
        "property float radius\nproperty uint object\nproperty uint id\n"
        "element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        render::escaped(parts_.scene.name), snapshot.frame, snapshot.time,
        geometry.positions.size() + particles, geometry.indices.size() / 3));
    for (const GeometryGroup& group : geometry.groups) {
      const Eigen::Vector4f& color = parts_.materials[group.material].look.color;
      for (std::size_t i = group.first_vertex; i < group.first_vertex + group.vertices; ++i)
        put_vertex(geometry.positions[i], geometry.normals[i], color.cwiseProduct(geometry.colors[i]), 0,
                   group.id, 0);
    }
    for (const GeometryParticles& p : geometry.particles)
      for (const render::Point& point : p.set->points)
        put_vertex(point.position, Eigen::Vector3f::UnitY(), point.color, point.radius, p.id,
                   static_cast<uint32_t>(point.id));
    for (std::size_t i = 0; i + 2 < geometry.indices.size(); i += 3) {
      put(uint8_t{3});
      for (std::size_t k = 0; k < 3; ++k) put(geometry.indices[i + k]);
    }
    render::write_file_atomically(render::frame_path(pattern_, snapshot.frame), bytes_);
  }
  void close() override {}
  std::vector<std::string> notes() const override {
    std::vector<std::string> notes = export_notes(parts_, "PLY", {LookFeature::vertex_colors}, {});
    if (!std::ranges::all_of(parts_.points, &FilmPoints::are_balls))
      notes.push_back("PLY has no smoke, streaks and pictures: all particles are exported as points");
    return notes;
  }

 private:
  template <class T>
  void put(T value) {
    const auto* p = reinterpret_cast<const uint8_t*>(&value);
    bytes_.insert(bytes_.end(), p, p + sizeof value);
  }
  void put_text(const std::string& text) { bytes_.insert(bytes_.end(), text.begin(), text.end()); }
  void put_vertex(const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                  const Eigen::Vector4f& color, float radius, uint32_t object, uint32_t id) {
    for (int i = 0; i < 3; ++i) put(position[i]);
    for (int i = 0; i < 3; ++i) put(normal[i]);
    for (int i = 0; i < 3; ++i) put(srgb_byte(color[i]));
    put(static_cast<uint8_t>(std::lround(255 * std::clamp(color.w(), 0.f, 1.f))));
    put(radius);
    put(object);
    put(id);
  }

  std::filesystem::path pattern_;
  const FilmParts& parts_;
  std::vector<uint8_t> bytes_;
};

}  // namespace

std::unique_ptr<FilmExport> make_ply_export(const std::filesystem::path& pattern, const FilmParts& parts) {
  return std::make_unique<PlyExport>(pattern, parts);
}

}  // namespace offstage::producer
