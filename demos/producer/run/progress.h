#pragma once
/// Displays the progress of a run: as a line with a bar on a terminal, as occasional plain lines in a log
/// file, or as JSON lines for programs. A pipe gets nothing by default.

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "producer/run/production.h"

namespace offstage::producer {

/// `automatic` means a bar if standard error is a terminal, plain lines if it is a file, otherwise none.
enum class ProgressStyle { automatic, bar, plain, json, none };

/// Returns the style that `automatic` means for the current standard error. Returns other styles unchanged.
ProgressStyle resolved(ProgressStyle style);

/// Returns a duration as text, rounded up: "8 s", "2 min 05 s", "1 h 20 min".
std::string duration_text(double seconds);

/// Returns the line for a terminal of `width` columns, in ASCII: bar, percentage, frames, remaining time, and
/// as many figures of the latest frame as fit.
std::string progress_bar(const Progress& progress, int width);

/// Prints the progress to standard error. Must be called by one thread at a time.
class ProgressPrinter {
 public:
  explicit ProgressPrinter(ProgressStyle style);
  void operator()(const Progress& progress);
  /// Ends the line of the progress on a terminal. Later output begins below it.
  void finish();

 private:
  ProgressStyle style_;
  double shown_fraction_ = 0;  // the bar never moves backwards
  std::chrono::steady_clock::time_point last_{};
};

/// Shows a long step of the set-up, such as reading models, while this object exists. A terminal shows the
/// elapsed seconds; a log file gets one line.
class StepNotice {
 public:
  StepNotice(ProgressStyle style, std::string what);
  ~StepNotice();
  StepNotice(const StepNotice&) = delete;
  StepNotice& operator=(const StepNotice&) = delete;

 private:
  void work();

  ProgressStyle style_;
  std::string what_;
  std::mutex mutex_;
  std::condition_variable ended_;
  bool end_ = false;
  std::thread thread_;  // the last member, because it must end before the others are destroyed
};

}  // namespace offstage::producer
