#include "producer/cli/run_progress.h"

#include <algorithm>

#include "producer/base/log.h"
#include "producer/run/cost.h"

namespace offstage::producer {

RunProgress::RunProgress(const Scene& scene, const ModelLibrary& models, const TalkOptions& talk)
    : scene_(scene),
      models_(models),
      quiet_(talk.quiet),
      printer_(talk.quiet ? ProgressStyle::none : talk.progress) {}

void RunProgress::operator()(const Progress& progress) {
  if (!quiet_ && !told_) warn_of_long_run(progress);
  printer_(progress);
}

void RunProgress::warn_of_long_run(const Progress& progress) {
  constexpr double kLong_s = 10;
  constexpr double kPatience_s = 3;  // the first frames take longer than later ones
  // Whether the time of a frame is known.
  const bool known = progress.done >= std::min(2, progress.total - 1);
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

}  // namespace offstage::producer
