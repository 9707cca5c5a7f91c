#pragma once
/// Export of films to other programs: the states of the simulation as USD, glTF, PLY, OBJ or CSV. An exporter
/// gets the same snapshots as the drawing.

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
  /// Writes a frame; frames must come in ascending order. Throws render::FileError.
  virtual void write(const Snapshot& snapshot) = 0;
  /// Completes the output. A single file has a temporary name until then.
  virtual void close() = 0;
  /// Describes the objects and properties that the format cannot hold, one per line; empty if there are none.
  virtual std::vector<std::string> notes() const { return {}; }
};

enum class ExportFormat { usd, gltf, ply, obj, csv };

struct ExportTarget {
  ExportFormat format = ExportFormat::usd;
  std::filesystem::path path;  ///< a file, or a pattern with '#' for one file per frame
  bool sequence() const { return path.filename().string().find('#') != std::string::npos; }
};

/// Parses the output OUT. Throws std::invalid_argument for an ending other than .usda, .glb, .ply, .obj and
/// .csv, and for a single file where the format needs a file per frame, or a pattern where it needs a single
/// file.
ExportTarget parse_export(const std::string& out);

/// `parts` must outlive the exporter. Throws render::FileError.
std::unique_ptr<FilmExport> make_export(const ExportTarget& target, const FilmParts& parts);

// The exporters of the formats.
std::unique_ptr<FilmExport> make_usd_export(const std::filesystem::path& file, const FilmParts& parts);
std::unique_ptr<FilmExport> make_gltf_export(const std::filesystem::path& file, const FilmParts& parts);
std::unique_ptr<FilmExport> make_ply_export(const std::filesystem::path& pattern, const FilmParts& parts);
std::unique_ptr<FilmExport> make_obj_export(const std::filesystem::path& pattern, const FilmParts& parts);
std::unique_ptr<FilmExport> make_csv_export(const std::filesystem::path& file, const FilmParts& parts);

}  // namespace offstage::producer
