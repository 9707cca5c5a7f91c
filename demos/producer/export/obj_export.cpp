// OBJ (Wavefront): one file per frame, and one file of materials beside them. Particles are points ("p")
// without size.

#include <algorithm>
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

namespace fs = std::filesystem;

/// Returns the name with its white space replaced, as OBJ requires.
std::string one_word(const std::string& name) {
  std::string out;
  for (const char c : name) out += static_cast<unsigned char>(c) <= 0x20 ? '_' : c;
  return out;
}

/// Returns a linear colour in the encoding of OBJ and MTL files, sRGB. Brighter light is written as it is.
std::string srgb(const Eigen::Vector3f& linear) {
  const auto encoded = [](float c) { return c > 1 ? c : render::srgb_encode(std::max(c, 0.f)); };
  return fmt::format("{} {} {}", encoded(linear.x()), encoded(linear.y()), encoded(linear.z()));
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
    using enum LookFeature;
    std::vector<std::string> notes =
        export_notes(parts_, "OBJ", {texture, glow_texture, normal_map, vertex_colors, mask, surface}, {});
    if (!parts_.points.empty())
      notes.push_back("OBJ has no size and colour of particles: they are written as points");
    return notes;
  }

 private:
  void write_group(const WorldGeometry& g, const GeometryGroup& group, std::string& out) const {
    out += fmt::format("o {}\nusemtl {}\n", one_word(group.object),
                       one_word(parts_.materials[group.material].name));
    const bool colored = parts_.materials[group.material].look.vertex_colors;
    for (std::size_t i = group.first_vertex; i < group.first_vertex + group.vertices; ++i) {
      const Eigen::Vector3f &p = g.positions[i], &n = g.normals[i];
      out += fmt::format("v {} {} {}", p.x(), p.y(), p.z());
      if (colored) out += " " + srgb(g.colors[i].head<3>());
      out += fmt::format("\nvn {} {} {}\nvt {} {}\n", n.x(), n.y(), n.z(), g.uvs[i].x(), 1 - g.uvs[i].y());
    }
    for (std::size_t i = group.first_index; i + 2 < group.first_index + group.indices; i += 3) {
      out += 'f';
      for (std::size_t k = 0; k < 3; ++k) out += fmt::format(" {0}/{0}/{0}", g.indices[i + k] + 1);
      out += '\n';
    }
  }

  void write_materials(const std::string& stem) const {
    std::string out;
    for (const FilmMaterial& m : parts_.materials) {
      const std::string name = one_word(m.name);
      const render::Material& look = m.look;
      out += fmt::format("newmtl {}\nKd {}\nKe {}\nPr {}\nPm {}\nd {}\nNi {}\n", name,
                         srgb(look.color.head<3>()), srgb(look.emission), look.roughness, look.metallic,
                         look.color.w() * (1 - look.transmission), look.refraction);
      const std::string base = stem + "." + name;
      write_map("map_Kd", base, look.base_color_texture, out);
      if (parts_.has_alpha(look.base_color_texture))
        out += "map_d " + options_of(look.base_color_texture) + picture_name(base) + "\n";
      write_map("map_Ke", base + ".Emission", look.emission_texture, out);
      const std::string slope = look.normal_scale == 1 ? "" : fmt::format("-bm {} ", look.normal_scale);
      write_map("norm " + slope, base + ".Normal", look.normal_texture, out);
    }
    render::write_file_atomically(pattern_.parent_path() / library_,
                                  {reinterpret_cast<const uint8_t*>(out.data()), out.size()});
  }

  /// Writes the picture of a map, if it has one, and adds its statement.
  void write_map(const std::string& statement, const std::string& name, const render::TextureMap& map,
                 std::string& out) const {
    const render::Image* image = parts_.texture(map);
    if (image == nullptr) return;
    const std::string picture = picture_name(name);
    render::write_png(pattern_.parent_path() / picture, *image);
    out += statement + (statement.ends_with(' ') ? "" : " ") + options_of(map) + picture + "\n";
  }
  static std::string options_of(const render::TextureMap& map) {
    return map.wrap_u == render::Wrap::clamp ? "-clamp on " : "";
  }
  static std::string picture_name(std::string name) {
    std::ranges::replace(name, '/', '_');
    return name + ".png";
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
