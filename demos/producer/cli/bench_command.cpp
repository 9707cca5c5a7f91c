// bench.

#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/cli/options.h"
#include "producer/run/method_bench.h"

namespace offstage::producer {
namespace {

struct BenchOptions {
  SceneOptions scene;
  std::string csv;
  int repeat = 1;  ///< runs of each method
  int threads = 0;
  bool force = false, quiet = false;
};

/// Simulates a scene by each of the algorithms that it can choose from, and prints a table.
int bench_command(const BenchOptions& options) {
  const LoadedScene loaded = load(options.scene, options.quiet);
  check_file(options.csv, options.force);
  const ModelLibrary models = load_models(loaded, options.scene, {.quiet = options.quiet});
  const auto threads = simulation_threads(options.threads);
  const std::vector<Method> methods = methods_of(loaded.scene);
  std::vector<LoadedScene> scenes;
  for (const Method& method : methods) scenes.push_back(load(options.scene, true, method.overrides));
  // The methods take turns, so that a busy machine slows all of them alike.
  std::vector<MethodResult> results;
  for (int round = 0; round < options.repeat; ++round)
    for (std::size_t i = 0; i < methods.size(); ++i) {
      const MethodResult result = run_method(methods[i].name, scenes[i], models);
      if (round == 0)
        results.push_back(result);
      else
        merge(results[i], result);
    }
  fmt::print("{}", to_text(results));
  if (!options.csv.empty()) write_text_file(options.csv, to_csv(results));
  return kOk;
}

}  // namespace

Command add_bench(CLI::App& app) {
  const auto options = std::make_shared<BenchOptions>();
  BenchOptions& bench = *options;
  CLI::App* command = app.add_subcommand(
      "bench",
      "Simulate a scene by each choice of solver and collision detection, and print a table of their speed, "
      "work, fall-backs and errors");
  add_scene(*command, bench.scene);
  add_timing(*command, bench.scene);
  command->add_option("--repeat", bench.repeat, "Runs of each method; the fastest one counts (default: 1)")
      ->check(CLI::Range(1, 100));
  command->add_option("--csv", bench.csv, "Write the table to this CSV file, too");
  add_threads(*command, bench.threads);
  command->add_flag("--force", bench.force, "Replace an existing file");
  command->add_flag("-q,--quiet", bench.quiet, "Print no warnings");
  return {command, [options] { return bench_command(*options); }};
}

}  // namespace offstage::producer
