#pragma once
/// Prints messages about a run: the progress, a note if the run will take long, and the warnings and notes at
/// the end.

#include <chrono>
#include <string>

#include "producer/cli/commands.h"
#include "producer/run/production.h"
#include "producer/run/progress.h"

namespace offstage::producer {

/// A ProgressCallback that prints the progress of a run. The scene and the models must outlive this object.
class RunProgress {
 public:
  RunProgress(const Scene& scene, const ModelLibrary& models, const LogOptions& log_options);
  void operator()(const Progress& progress);
  /// Ends the line of the progress on a terminal. Later output begins below it.
  void finish() { printer_.finish(); }

 private:
  void warn_of_long_run(const Progress& progress);

  const Scene& scene_;
  const ModelLibrary& models_;
  const bool quiet_;
  ProgressPrinter printer_;
  bool told_ = false;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Writes the statistics of a run to `stats_file`, unless this name is empty. Then prints the warnings and
/// notes of the run.
void report_run(const RunStats& stats, const LogOptions& log_options, const std::string& stats_file);
/// Prints how many of the `total` frames an interrupted run has finished, and `advice` on how to continue.
/// Returns the exit code of the command.
int interrupted(const RunStats& stats, int total, const std::string& advice);

}  // namespace offstage::producer
