// The command simulate: simulates without drawing.

#include <memory>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/cli/run_progress.h"
#include "producer/run/output.h"
#include "producer/run/production.h"

namespace offstage::producer {
namespace {

struct SimulateOptions {
  SceneOptions scene;
  LogOptions log;
  std::string trace, contacts, cloths, cloth_points, joints, particles, trace_every = "frame", cache, stats;
  int threads = 0;
  bool force = false;
};

int simulate_command(const SimulateOptions& options) {
  const LoadedScene loaded = load(options.scene, options.log.quiet);
  const ModelLibrary models = load_models(loaded, options.scene, options.log);
  const std::vector<std::string> files = {options.stats,    options.trace,        options.contacts,
                                          options.cloths,   options.cloth_points, options.joints,
                                          options.particles};
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (files[i] == "-") throw OutputError("-: tables and statistics need the name of a file");
    check_file(files[i], options.force);
    for (std::size_t k = 0; k < i; ++k) check_distinct(files[k], files[i]);
  }
  check_not_read(files, options.scene);
  const auto threads = simulation_threads(options.threads);
  SimulateJob job{.cache = {},
                  .force = options.force,
                  .trace = {},
                  .contacts = {},
                  .cloths = {},
                  .joints = {},
                  .particles = {},
                  .cloth_points = {},
                  .trace_every_step = options.trace_every == "step"};
  if (!options.cache.empty()) job.cache = options.cache;
  if (!options.trace.empty()) job.trace = options.trace;
  if (!options.contacts.empty()) job.contacts = options.contacts;
  if (!options.cloths.empty()) job.cloths = options.cloths;
  if (!options.cloth_points.empty()) job.cloth_points = options.cloth_points;
  if (!options.joints.empty()) job.joints = options.joints;
  if (!options.particles.empty()) job.particles = options.particles;
  RunProgress progress(loaded.scene, models, options.log);
  const RunStats stats = simulate_frames(loaded, models, job, std::ref(progress));
  progress.finish();
  report_run(stats, options.log, options.stats);
  if (stats.interrupted_by) return interrupted(stats, loaded.scene.frame_count(), "");
  if (options.stats.empty()) fmt::print("{}", to_json(stats));
  return kOk;
}

}  // namespace

Command add_simulate(CLI::App& app) {
  const auto options = std::make_shared<SimulateOptions>();
  SimulateOptions& simulate = *options;
  CLI::App* command = app.add_subcommand("simulate", "Simulate without drawing; prints statistics as JSON");
  add_scene(*command, simulate.scene);
  add_timing(*command, simulate.scene);
  command->add_option("--trace", simulate.trace,
                      "CSV of position, orientation and velocities of moving objects");
  command->add_option("--contacts", simulate.contacts,
                      "CSV of the contact points of bodies, with their forces");
  command->add_option("--cloths", simulate.cloths, "CSV of strain, contacts and volume of cloths");
  command->add_option("--cloth-points", simulate.cloth_points,
                      "CSV of position and velocity of the vertices of cloths");
  command->add_option("--joints", simulate.joints, "CSV of the loads and positions of joints");
  command->add_option(
      "--particles", simulate.particles,
      "Table of all particles, emitted ones included: CSV, or binary if its name ends in .bin");
  command->add_option("--trace-every", simulate.trace_every, "Interval of the CSV rows: frame or step")
      ->check(CLI::IsMember({"frame", "step"}));
  command->add_option("--cache", simulate.cache, "Folder for one snapshot per frame, for `render --cache`");
  command->add_option("--stats", simulate.stats,
                      "Write the statistics to this JSON file instead of standard output");
  add_threads(*command, simulate.threads);
  command->add_flag("--force", simulate.force, "Replace existing output");
  add_log_options(*command, simulate.log);
  return {command, [options] { return simulate_command(*options); }};
}

}  // namespace offstage::producer
