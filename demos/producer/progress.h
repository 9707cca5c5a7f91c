#pragma once
/// How a run talks while it works: one changing line on a terminal, a plain line now and then in a log, JSON
/// lines for programs.

#include <chrono>
#include <string>

#include "producer/production.h"

namespace offstage::producer {

enum class ProgressStyle { automatic, plain, json, none };

/// Writes to standard error.
class ProgressPrinter {
 public:
  explicit ProgressPrinter(ProgressStyle style);
  void operator()(const Progress& progress);
  /// Ends the terminal's line.
  void finish();

 private:
  ProgressStyle style_;
  bool line_open_ = false;
  std::chrono::steady_clock::time_point last_{};
};

}  // namespace offstage::producer
