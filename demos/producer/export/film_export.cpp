#include "producer/export/film_export.h"

#include <stdexcept>

namespace offstage::producer {

ExportTarget parse_export(const std::string& out) {
  ExportTarget target{.format = ExportFormat::usd, .path = out};
  const std::string ending = target.path.extension().string();
  if (ending == ".usda" || ending == ".usd")
    target.format = ExportFormat::usd;
  else if (ending == ".glb")
    target.format = ExportFormat::gltf;
  else if (ending == ".ply")
    target.format = ExportFormat::ply;
  else if (ending == ".obj")
    target.format = ExportFormat::obj;
  else if (ending == ".csv")
    target.format = ExportFormat::csv;
  else if (ending == ".usdc" || ending == ".usdz")
    throw std::invalid_argument(
        out + ": USD is written as text; use the ending .usda (usdcat converts it to .usdc)");
  else if (ending == ".gltf")
    throw std::invalid_argument(out + ": glTF is written as one binary file; use the ending .glb");
  else if (ending == ".abc")
    throw std::invalid_argument(out + ": Alembic is not supported; use .usda, which holds the same data");
  else
    throw std::invalid_argument(out + ": the name must end in .usda, .glb, .ply, .obj or .csv");
  const bool per_frame = target.format == ExportFormat::ply || target.format == ExportFormat::obj;
  if (per_frame && !target.sequence())
    throw std::invalid_argument(
        out + ": " + ending + " is one file per frame; give a pattern such as " +
        (target.path.parent_path() / (target.path.stem().string() + "_####" + ending)).string());
  if (!per_frame && target.sequence())
    throw std::invalid_argument(out + ": " + ending + " is one file for all frames; leave out the #");
  return target;
}

std::unique_ptr<FilmExport> make_export(const ExportTarget& target, const FilmParts& parts) {
  switch (target.format) {
    case ExportFormat::usd:
      return make_usd_export(target.path, parts);
    case ExportFormat::gltf:
      return make_gltf_export(target.path, parts);
    case ExportFormat::ply:
      return make_ply_export(target.path, parts);
    case ExportFormat::obj:
      return make_obj_export(target.path, parts);
    case ExportFormat::csv:
      break;
  }
  return make_csv_export(target.path, parts);
}

}  // namespace offstage::producer
