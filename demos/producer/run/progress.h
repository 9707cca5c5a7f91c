#pragma once
/// Display of a run's progress: one line with a bar on a terminal, occasional plain lines in a log file, JSON
/// lines for programs, nothing on a pipe.

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "producer/run/production.h"

namespace offstage::producer {

/// `automatic`: a bar on a terminal, plain lines if standard error is a file, else nothing.
enum class ProgressStyle { automatic, bar, plain, json, none };

/// Resolves `automatic` for the current standard error; other styles are returned unchanged.
ProgressStyle resolved(ProgressStyle style);

/// "8 s", "2 min 05 s", "1 h 20 min".
std::string duration_text(double seconds);

/// The line on a terminal: bar, percentage, frames, time left, and as many figures of the latest frame as fit
/// into `width` columns. ASCII.
std::string progress_bar(const Progress& progress, int width);

/// Writes to standard error. Must be called by one thread at a time.
class ProgressPrinter {
 public:
  explicit ProgressPrinter(ProgressStyle style);
  void operator()(const Progress& progress);
  /// Keeps the latest progress on a terminal and continues below it.
  void finish();

 private:
  ProgressStyle style_;
  double shown_fraction_ = 0;  // the bar never moves backwards
  std::chrono::steady_clock::time_point last_{};
};

/// Shows a long step of the set-up while it runs: with the elapsed seconds on a terminal, once in a log file.
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
  std::thread thread_;  // last, so that it ends first
};

}  // namespace offstage::producer
