#pragma once
/// Exports films to other programs, as USD, glTF, PLY, OBJ or CSV. An exporter gets the same snapshots of the
/// simulation from which frames are drawn.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "producer/build/snapshot.h"
#include "producer/export/film_parts.h"

namespace offstage::producer {

class FilmExport {
 public:
  virtual ~FilmExport() = default;
  /// Writes a frame. Must be called with frames in ascending order. Throws render::FileError.
  virtual void write(const Snapshot& snapshot) = 0;
  /// Completes the output. A single file has a temporary name until then. Throws render::FileError.
  virtual void close() = 0;
  /// Returns one note for each kind of object or property of the film that the format cannot express.
  virtual std::vector<std::string> notes() const { return {}; }
};

enum class ExportFormat { usd, gltf, ply, obj, csv };

struct ExportTarget {
  ExportFormat format = ExportFormat::usd;
  std::filesystem::path path;  ///< a file, or a pattern with '#' for one file per frame
  bool sequence() const { return path.filename().string().find('#') != std::string::npos; }
};

/// Parses the argument OUT. The ending of the name gives the format: .usda, .glb, .ply, .obj or .csv. PLY and
/// OBJ need a pattern, because they have a file for each frame; the other formats need a single file.
/// Otherwise throws std::invalid_argument.
ExportTarget parse_export(const std::string& out);

/// Makes the exporter for a target. `parts` must outlive the exporter. Throws render::FileError.
std::unique_ptr<FilmExport> make_export(const ExportTarget& target, const FilmParts& parts);

// Each function makes the exporter for one format.
std::unique_ptr<FilmExport> make_usd_export(const std::filesystem::path& file, const FilmParts& parts);
std::unique_ptr<FilmExport> make_gltf_export(const std::filesystem::path& file, const FilmParts& parts);
std::unique_ptr<FilmExport> make_ply_export(const std::filesystem::path& pattern, const FilmParts& parts);
std::unique_ptr<FilmExport> make_obj_export(const std::filesystem::path& pattern, const FilmParts& parts);
std::unique_ptr<FilmExport> make_csv_export(const std::filesystem::path& file, const FilmParts& parts);

}  // namespace offstage::producer
