// The command export: writes the motion of a film for other programs.

#include <functional>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "producer/base/log.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/cli/options.h"
#include "producer/cli/run_progress.h"
#include "producer/export/film_export.h"
#include "producer/run/frame_list.h"
#include "producer/run/output.h"
#include "producer/run/production.h"
#include "render/file_io.h"
#include "render/sink.h"

namespace offstage::producer {
namespace {

struct ExportOptions {
  SceneOptions scene;
  LogOptions log;
  std::string out, frames, cache;
  int threads = 0;
  bool force = false;
};

/// Throws OutputError before the work begins if the output already exists and must not be replaced.
void check_target(const ExportTarget& target, const std::vector<int>& frames, const ExportOptions& options) {
  check_folder(target.path);
  render::create_parent_folders(target.path);
  std::vector<std::string> files;
  if (!target.sequence()) files.push_back(target.path.string());
  for (const int frame : frames)
    if (target.sequence()) files.push_back(render::frame_path(target.path, frame).string());
  for (const std::string& file : files) check_file(file, options.force);
  check_not_read(files, options.scene);
}

int export_command(const ExportOptions& options) {
  const ExportTarget target = parse_export(options.out);
  const LoadedScene loaded = load(options.scene, options.log.quiet);
  const ModelLibrary models = load_models(loaded, options.scene, options.log);
  const std::vector<int> frames = parse_frames(options.frames, loaded.scene.frame_count());
  check_target(target, frames, options);
  const auto threads = simulation_threads(options.threads);

  const FilmParts parts(loaded.scene, models);
  const std::unique_ptr<FilmExport> film = make_export(target, parts);
  RunProgress progress(loaded.scene, models, options.log);
  SnapshotJob job{.frames = frames, .cache = {}};
  if (!options.cache.empty()) job.cache = options.cache;
  const RunStats stats = visit_frames(
      loaded, models, job, [&](const Snapshot& snapshot) { film->write(snapshot); }, std::ref(progress));
  progress.finish();
  if (stats.interrupted_by) {
    log("interrupted: {} of {} frames done\n", stats.frames, frames.size());
    return 128 + stats.interrupted_by;
  }
  film->close();
  if (!options.log.quiet)
    for (const std::string& note : film->notes()) log("note: {}\n", note);
  print_output_name(options.out);
  return kOk;
}

}  // namespace

Command add_export(CLI::App& app) {
  const auto options = std::make_shared<ExportOptions>();
  ExportOptions& given = *options;
  CLI::App* command = app.add_subcommand(
      "export", "Simulate a scene and write its motion for other programs: USD, glTF, PLY, OBJ or CSV");
  add_scene(*command, given.scene);
  command
      ->add_option("-o,--output", given.out,
                   "film.usda, film.glb or film.csv; frames/####.ply or frames/####.obj, one file per frame")
      ->required();
  add_timing(*command, given.scene);
  command->add_option("--frames", given.frames,
                      "Frames to export: 1-30,40,50-90x2 (negative numbers count from the end)");
  command->add_option("--cache", given.cache,
                      "Take the snapshots of `simulate --cache` instead of simulating");
  add_threads(*command, given.threads);
  command->add_flag("--force", given.force, "Replace existing output");
  add_log_options(*command, given.log);
  return {command, [options] { return export_command(*options); }};
}

}  // namespace offstage::producer
