#include "producer/run/time_left.h"

#include <algorithm>

namespace offstage::producer {

void TimeLeft::simulated(double ms) {
  ++simulated_;
  simulation_ms_ += ms;
}

void TimeLeft::finished(double drawing_ms, double elapsed_s) {
  ++done_;
  drawing_ms_ += drawing_ms;
  if (done_ > warm_ups_) return;
  warm_simulated_ = simulated_;
  warm_drawing_ms_ = drawing_ms_;
  warm_s_ = elapsed_s;
}

double TimeLeft::simulation_mean_ms() const {
  return simulated_ > 0 ? simulation_ms_ / simulated_ : 0;
}

double TimeLeft::drawing_mean_ms() const {
  if (is_steady()) return (drawing_ms_ - warm_drawing_ms_) / (done_ - warm_ups_);
  return done_ > 0 ? drawing_ms_ / done_ : guess_ms_;
}

double TimeLeft::fraction() const {
  if (done_ == frames_) return 1;
  const double simulating = simulation_mean_ms(), drawing = drawing_mean_ms();
  const double done = simulating * simulated_ + drawing * done_,
               all = simulating * to_simulate_ + drawing * frames_;
  return all > 0 ? std::min(1.0, done / all) : 0;
}

double TimeLeft::seconds(double elapsed_s) const {
  constexpr double kKnown = 0.02;  // fraction of the work after which the rest can be estimated
  if (fraction() <= kKnown) return 0;
  if (!is_steady()) return elapsed_s * (1 / fraction() - 1);
  // Simulation and drawing run at the same time, so the work since the warm-up is compared with the time
  // since then.
  const double simulating = simulation_mean_ms(), drawing = drawing_mean_ms();
  const double done = simulating * (simulated_ - warm_simulated_) + drawing * (done_ - warm_ups_),
               rest = simulating * std::max(0, to_simulate_ - simulated_) + drawing * (frames_ - done_);
  return done > 0 ? (elapsed_s - warm_s_) * rest / done : 0;
}

}  // namespace offstage::producer
