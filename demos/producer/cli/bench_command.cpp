// The command bench: compares the algorithms of a scene.

#include <algorithm>
#include <chrono>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "producer/base/log.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/cli/options.h"
#include "producer/run/method_bench.h"

namespace offstage::producer {
namespace {

struct BenchOptions {
  SceneOptions scene;
  std::string csv;
  int repeat = 1;       ///< number of runs of each method
  double limit_s = 60;  ///< longest time of a run [s]
  int threads = 0;
  bool force = false;
  LogOptions log;
};

/// Shows which method is running: in a status line on a terminal, or by a line for each run in a log file.
class BenchProgress {
 public:
  BenchProgress(const LogOptions& log_options, std::size_t runs)
      : style_(log_options.quiet ? ProgressStyle::none : resolved(log_options.progress)), runs_(runs) {}

  void begin(const std::string& method) {
    ++run_;
    method_ = method;
    start_ = std::chrono::steady_clock::now();
  }

  void operator()(double fraction) {
    const auto now = std::chrono::steady_clock::now();
    if (style_ != ProgressStyle::bar || now - shown_ < std::chrono::milliseconds(100)) return;
    shown_ = now;
    const std::string line =
        fmt::format("run {} of {}: {}  {:.0f} %  {}", run_, runs_, method_, 100 * fraction, elapsed(now));
    show_status(line.substr(0, static_cast<std::size_t>(std::max(0, terminal_width() - 1))));
  }

  void end(const MethodResult& result) {
    if (style_ == ProgressStyle::bar) show_status("");
    if (style_ == ProgressStyle::bar || style_ == ProgressStyle::plain)
      log("run {} of {}: {}  {:.0f} steps/s  {}{}{}\n", run_, runs_, method_, result.steps_per_second(),
          elapsed(std::chrono::steady_clock::now()), result.fault.empty() ? "" : "  ", result.fault);
  }

 private:
  std::string elapsed(std::chrono::steady_clock::time_point now) const {
    return duration_text(std::chrono::duration<double>(now - start_).count());
  }

  ProgressStyle style_;
  std::size_t runs_, run_ = 0;
  std::string method_;
  std::chrono::steady_clock::time_point start_, shown_{};
};

/// Simulates a scene with each algorithm that it can select, and prints a table of the results.
int bench_command(const BenchOptions& options) {
  const LoadedScene loaded = load(options.scene, options.log.quiet);
  check_file(options.csv, options.force);
  check_not_read({options.csv}, options.scene);
  const ModelLibrary models = load_models(loaded, options.scene, options.log);
  const auto threads = simulation_threads(options.threads);
  const std::vector<Method> methods = methods_of(loaded.scene);
  std::vector<LoadedScene> scenes;
  for (const Method& method : methods) scenes.push_back(load(options.scene, true, method.overrides));
  BenchProgress progress(options.log, methods.size() * static_cast<std::size_t>(options.repeat));
  // The methods take turns, so that a busy machine slows all of them alike.
  std::vector<MethodResult> results;
  for (int round = 0; round < options.repeat; ++round)
    for (std::size_t i = 0; i < methods.size(); ++i) {
      progress.begin(methods[i].name);
      if (round > 0 && !results[i].fault.empty()) continue;  // a further run would end early, too
      const MethodResult result = run_method(methods[i].name, scenes[i], models, options.limit_s,
                                             [&](double fraction) { progress(fraction); });
      progress.end(result);
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
      "Simulate a scene with each choice of solver and collision detection, and print a table of their "
      "speed, "
      "work, fall-backs and errors. The whole film is simulated once for each choice, without pictures; "
      "--duration shortens it");
  add_scene(*command, bench.scene);
  add_timing(*command, bench.scene);
  command->add_option("--repeat", bench.repeat, "Runs of each method; the fastest one counts (default: 1)")
      ->check(CLI::Range(1, 100));
  command->add_option("--csv", bench.csv, "Write the table to this CSV file, too");
  command
      ->add_option(
          "--limit", bench.limit_s,
          "Stop a run after this many seconds; the table then gives the simulated time (default: 60)")
      ->check(CLI::PositiveNumber);
  add_threads(*command, bench.threads);
  command->add_flag("--force", bench.force, "Replace an existing file");
  add_log_options(*command, bench.log);
  return {command, [options] { return bench_command(*options); }};
}

}  // namespace offstage::producer
