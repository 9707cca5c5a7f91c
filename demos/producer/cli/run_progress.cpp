#include "producer/cli/run_progress.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "producer/base/log.h"
#include "producer/run/cost.h"
#include "producer/run/run_notes.h"
#include "producer/run/run_report.h"

namespace offstage::producer {

RunProgress::RunProgress(const Scene& scene, const ModelLibrary& models, const LogOptions& log_options)
    : scene_(scene),
      models_(models),
      quiet_(log_options.quiet),
      printer_(log_options.quiet ? ProgressStyle::none : log_options.progress) {}

void RunProgress::operator()(const Progress& progress) {
  if (!quiet_ && !told_) warn_of_long_run(progress);
  printer_(progress);
}

void RunProgress::warn_of_long_run(const Progress& progress) {
  constexpr double kLong_s = 10;
  constexpr double kPatience_s = 3;
  // Of a single frame, only the simulation is known before it is finished.
  const bool known = progress.is_steady || progress.total == 1;
  const double elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  const double all = elapsed + progress.eta_s;
  if (!known || elapsed < kPatience_s || progress.fraction <= 0 || progress.fraction >= 1 || all < kLong_s)
    return;
  told_ = true;
  const bool simulating = progress.simulating_s > progress.drawing_s;
  const std::vector<ObjectCost> objects = object_costs(scene_, models_);
  const auto work = simulating ? &ObjectCost::simulation_s : &ObjectCost::drawing_s;
  const auto costliest = std::ranges::max_element(objects, {}, work);
  std::string advice;
  if (costliest != objects.end() && (*costliest).*work > 0)
    advice = fmt::format(" The most expensive object is the {}; {} would make it faster.",
                         describe(*costliest), costliest->advice);
  log("note: this takes about {}, most of it for the {}.{}\n", duration_text(all),
      simulating ? "simulation" : "drawing", advice);
}

void report_run(const RunStats& stats, const LogOptions& log_options, const std::string& stats_file) {
  if (!stats_file.empty()) write_text_file(stats_file, to_json(stats));
  if (log_options.quiet) return;
  if (!stats.blank_frames.empty())
    log("warning: frame {}{} is blank: all pixels are equal. Check the camera, the lights and the exposure\n",
        stats.blank_frames.front(),
        stats.blank_frames.size() > 1 ? fmt::format(" (and {} more)", stats.blank_frames.size() - 1) : "");
  for (const std::string& note : notes_of(stats.totals)) log("{}\n", note);
  if (!log_options.verbose) return;
  for (const auto& [name, times] : {std::pair("simulate", &stats.sim), std::pair("draw", &stats.render),
                                    std::pair("encode", &stats.encode)}) {
    const StageTimes::Summary s = times->summary();
    log("{:9} {:8.2f} ms mean  {:8.2f} p50  {:8.2f} p95  {:8.2f} max\n", name, s.mean, s.p50, s.p95, s.max);
  }
  log("{} frames in {:.2f} s, first after {:.2f} s, {:.0f} MB\n", stats.frames, stats.wall_s, stats.startup_s,
      peak_rss_mb());
}

int interrupted(const RunStats& stats, int total, const std::string& advice) {
  log("interrupted: {} of {} frames done{}\n", stats.frames + stats.frames_kept, total, advice);
  return 128 + stats.interrupted_by;
}

}  // namespace offstage::producer
