// CSV: one row for each body, particle and point of a cloth at each frame, for tables and plots.

#include <fmt/format.h>

#include "producer/export/film_export.h"
#include "render/output_file.h"

namespace offstage::producer {
namespace {

class CsvExport : public FilmExport {
 public:
  CsvExport(const std::filesystem::path& file, const FilmParts& parts) : parts_(parts), file_(file) {
    put("frame,time,kind,object,id,x,y,z,qw,qx,qy,qz,vx,vy,vz,radius,red,green,blue,alpha\n");
  }

  void write(const Snapshot& snapshot) override {
    std::string rows;
    const auto begin = [&](const char* kind, const std::string& object, uint64_t id,
                           const Eigen::Vector3f& p) {
      rows += fmt::format("{},{},{},{},{},{},{},{},", snapshot.frame, snapshot.time, kind, quoted(object), id,
                          p.x(), p.y(), p.z());
    };
    for (const FilmBody& body : parts_.bodies) {
      if (!body.lifetime.contains(snapshot.time)) continue;
      const BodySample& s = body.slot ? snapshot.bodies[*body.slot] : body.place;
      begin("body", body.name, 0, s.position);
      const Eigen::Quaternionf& q = s.orientation;
      rows += fmt::format("{},{},{},{},,,,,,,,\n", q.w(), q.x(), q.y(), q.z());
    }
    for (const FilmCloth& cloth : parts_.cloths) {
      if (!cloth.lifetime.contains(snapshot.time)) continue;
      const ClothSample& sample = snapshot.cloths[cloth.cloth];
      for (std::size_t i = 0; i < sample.points.size(); ++i) {
        const Eigen::Vector3f& v = sample.velocities[i];
        begin("cloth", cloth.name, i, sample.points[i]);
        rows += fmt::format(",,,,{},{},{},,,,,\n", v.x(), v.y(), v.z());
      }
    }
    for (const FilmPoints& points : parts_.points)
      for (const render::Point& p : snapshot.point_sets[points.set].points) {
        begin("particle", points.name, p.id, p.position);
        rows += fmt::format(",,,,{},{},{},{},{},{},{},{}\n", p.velocity.x(), p.velocity.y(), p.velocity.z(),
                            p.radius, p.color.x(), p.color.y(), p.color.z(), p.color.w());
      }
    put(rows);
  }
  void close() override { file_.commit(); }

 private:
  void put(const std::string& text) {
    file_.write({reinterpret_cast<const uint8_t*>(text.data()), text.size()});
  }
  static std::string quoted(const std::string& name) {
    if (name.find_first_of(",\"\n") == std::string::npos) return name;
    std::string out = "\"";
    for (const char c : name) out += c == '"' ? "\"\"" : std::string(1, c);
    return out + "\"";
  }

  const FilmParts& parts_;
  render::OutputFile file_;
};

}  // namespace

std::unique_ptr<FilmExport> make_csv_export(const std::filesystem::path& file, const FilmParts& parts) {
  return std::make_unique<CsvExport>(file, parts);
}

}  // namespace offstage::producer
