// bench.

#include <fmt/format.h>

#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/run/method_bench.h"

namespace offstage::producer {

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

}  // namespace offstage::producer
