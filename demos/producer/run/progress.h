#pragma once
/// How a run shows its progress: one steady line with a bar on a terminal, a plain line now and then in a log
/// file, JSON lines for programs, nothing on a pipe.

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "producer/run/production.h"

namespace offstage::producer {

/// `automatic`: a bar on a terminal, plain lines if standard error is a file, else nothing.
enum class ProgressStyle { automatic, bar, plain, json, none };

/// What `automatic` stands for with today's standard error; any other style is itself.
ProgressStyle resolved(ProgressStyle style);

/// "8 s", "2 min 05 s", "1 h 20 min".
std::string duration_text(double seconds);

/// The line of a terminal: bar, percentage, frames, time left, and figures of the latest frame as far as
/// `width` columns allow. ASCII.
std::string progress_bar(const Progress& progress, int width);

/// Writes to standard error. One thread at a time may call it.
class ProgressPrinter {
 public:
  explicit ProgressPrinter(ProgressStyle style);
  void operator()(const Progress& progress);
  /// Ends the terminal's line.
  void finish();

 private:
  ProgressStyle style_;
  double shown_fraction_ = 0;  // the bar never runs backwards
  std::chrono::steady_clock::time_point last_{};
};

/// Says what a long step of the set-up does for as long as it takes: with the seconds on a terminal, once in
/// a log file.
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
  std::thread thread_;  // last
};

}  // namespace offstage::producer
