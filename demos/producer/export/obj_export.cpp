// OBJ (Wavefront): one file per frame, and one file of materials beside them. Particles are points ("p")
// without size.

#include <cmath>

#include <fmt/format.h>

#include "producer/export/film_export.h"
#include "producer/export/world_geometry.h"
#include "render/file_io.h"
#include "render/image_io.h"
#include "render/sink.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;

/// Returns the name with its white space replaced, as OBJ requires.
std::string one_word(const std::string& name) {
  std::string out;
  for (const char c : name) out += static_cast<unsigned char>(c) <= 0x20 ? '_' : c;
  return out;
}

class ObjExport : public FilmExport {
 public:
  ObjExport(fs::path pattern, const FilmParts& parts) : pattern_(std::move(pattern)), parts_(parts) {
    std::string stem = pattern_.stem().string();
    std::erase(stem, '#');
    if (stem.empty()) stem = "materials";
    library_ = stem + ".mtl";
    write_materials(stem);
  }

  void write(const Snapshot& snapshot) override {
    const WorldGeometry geometry = world_geometry(parts_, snapshot);
    std::string out = fmt::format("# {} frame {} time {} s\nmtllib {}\n", render::escaped(parts_.scene.name),
                                  snapshot.frame, snapshot.time, library_);
    for (const GeometryGroup& group : geometry.groups) write_group(geometry, group, out);
    std::size_t next = geometry.positions.size() + 1;  // OBJ indices start at 1
    for (const GeometryParticles& particles : geometry.particles) {
      if (particles.set->points.empty()) continue;
      out += "o " + one_word(particles.object) + "\n";
      for (const render::Point& p : particles.set->points)
        out += fmt::format("v {} {} {}\np {}\n", p.position.x(), p.position.y(), p.position.z(), next++);
    }
    render::write_file_atomically(render::frame_path(pattern_, snapshot.frame),
                                  {reinterpret_cast<const uint8_t*>(out.data()), out.size()});
  }
  void close() override {}
  std::vector<std::string> notes() const override {
    if (parts_.points.empty()) return {};
    return {"OBJ has no size and colour of particles: they are written as points"};
  }

 private:
  void write_group(const WorldGeometry& g, const GeometryGroup& group, std::string& out) const {
    out += fmt::format("o {}\nusemtl {}\n", one_word(group.object),
                       one_word(parts_.materials[group.material].name));
    for (std::size_t i = group.first_vertex; i < group.first_vertex + group.vertices; ++i) {
      const Eigen::Vector3f &p = g.positions[i], &n = g.normals[i];
      out += fmt::format("v {} {} {}\nvn {} {} {}\nvt {} {}\n", p.x(), p.y(), p.z(), n.x(), n.y(), n.z(),
                         g.uvs[i].x(), 1 - g.uvs[i].y());
    }
    for (std::size_t i = group.first_index; i + 2 < group.first_index + group.indices; i += 3) {
      out += 'f';
      for (std::size_t k = 0; k < 3; ++k) out += fmt::format(" {0}/{0}/{0}", g.indices[i + k] + 1);
      out += '\n';
    }
  }

  void write_materials(const std::string& stem) const {
    const fs::path folder = pattern_.parent_path();
    std::string out;
    for (const FilmMaterial& m : parts_.materials) {
      const std::string name = one_word(m.name);
      const Eigen::Vector4f& c = m.look.color;
      out +=
          fmt::format("newmtl {}\nKd {} {} {}\nKe {} {} {}\nPr {}\nPm {}\nd {}\nNi {}\n", name, c.x(), c.y(),
                      c.z(), m.look.emission.x(), m.look.emission.y(), m.look.emission.z(), m.look.roughness,
                      m.look.metallic, c.w() * (1 - m.look.transmission), m.look.refraction);
      if (!m.texture) continue;
      std::string picture = stem + "." + name + ".png";
      for (char& letter : picture)
        if (letter == '/') letter = '_';
      render::write_png(folder / picture, *m.texture);
      const bool clamped = m.look.base_color_texture.wrap_u == render::Wrap::clamp;
      out += std::string("map_Kd ") + (clamped ? "-clamp on " : "") + picture + "\n";
    }
    render::write_file_atomically(folder / library_,
                                  {reinterpret_cast<const uint8_t*>(out.data()), out.size()});
  }

  fs::path pattern_;
  const FilmParts& parts_;
  std::string library_;
};

}  // namespace

std::unique_ptr<FilmExport> make_obj_export(const fs::path& pattern, const FilmParts& parts) {
  return std::make_unique<ObjExport>(pattern, parts);
}

}  // namespace offstage::producer
