#include "producer/run/progress.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "producer/base/log.h"

namespace offstage::producer {
namespace {

using std::chrono::steady_clock;

constexpr std::chrono::milliseconds kTerminalInterval{100};
constexpr std::chrono::seconds kLogInterval{5};

std::string frames_text(const Progress& p) {
  if (p.done == 0 && p.frames_simulated > 0)
    return fmt::format("simulating frame {}/{}", p.frames_simulated, p.frames_to_simulate);
  return fmt::format("frame {}/{}", p.done, p.total);
}

std::string left_text(const Progress& p) {
  return p.eta_s > 0 ? duration_text(p.eta_s) + " left" : "";
}

/// Returns figures of the latest frame as texts, the most important first.
std::vector<std::string> details_of(const Progress& p) {
  std::vector<std::string> details;
  for (const auto& [name, ms] :
       {std::pair("sim", p.sim_ms), std::pair("draw", p.render_ms), std::pair("encode", p.encode_ms)})
    if (ms > 0) details.push_back(fmt::format("{} {:.0f} ms", name, ms));
  if (p.particles > 0) details.push_back(fmt::format("{} particles", p.particles));
  return details;
}

std::string plain_text(const Progress& p) {
  std::string line = fmt::format("{}  {:.0f} %", frames_text(p), std::floor(100 * p.fraction));
  if (const std::string left = left_text(p); !left.empty()) line += "  " + left;
  for (const std::string& detail : details_of(p)) line += "  " + detail;
  return line;
}

}  // namespace

ProgressStyle resolved(ProgressStyle style) {
  if (style != ProgressStyle::automatic) return style;
  const char* term = std::getenv("TERM");
  if (isatty(STDERR_FILENO))
    return term && std::string_view(term) != "dumb" ? ProgressStyle::bar : ProgressStyle::plain;
  struct stat status {};
  const bool file = fstat(STDERR_FILENO, &status) == 0 && S_ISREG(status.st_mode);
  return file ? ProgressStyle::plain : ProgressStyle::none;
}

std::string duration_text(double seconds) {
  constexpr double kLongest = 1e9;  // about thirty years
  const auto s = static_cast<long>(std::ceil(std::clamp(seconds, 0.0, kLongest)));
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{} min {:02} s", s / 60, s % 60);
  return fmt::format("{} h {:02} min", s / 3600, s % 3600 / 60);
}

std::string progress_bar(const Progress& p, int width) {
  constexpr int kLongestBar = 30, kShortestBar = 10, kPercent = 7;  // "  100 %"
  const double fraction = std::clamp(p.fraction, 0.0, 1.0);
  const auto columns = [](const std::string& text) { return static_cast<int>(text.size()); };

  std::string text = fmt::format("  {:3.0f} %", std::floor(100 * fraction));
  std::vector<std::string> parts = {frames_text(p), left_text(p)};
  for (std::string& detail : details_of(p)) parts.push_back(std::move(detail));
  // The length of the bar depends only on the width, so that the text beside it does not move.
  const int bar = std::clamp(width / 4, kShortestBar, kLongestBar);
  const int room = width - 1 - (bar + 2);  // some terminals wrap when the last column is written
  if (room < kPercent) return width > kPercent ? text.substr(2) : "";
  for (const std::string& part : parts) {
    if (part.empty()) continue;
    if (columns(text) + 2 + columns(part) > room) break;
    text += "  " + part;
  }
  const int filled = static_cast<int>(fraction * bar);
  std::string line = "[" + std::string(static_cast<std::size_t>(filled), '=');
  if (filled < bar) line += ">" + std::string(static_cast<std::size_t>(bar - filled - 1), ' ');
  return line + "]" + text;
}

ProgressPrinter::ProgressPrinter(ProgressStyle style) : style_(resolved(style)) {}

void ProgressPrinter::operator()(const Progress& progress) {
  if (style_ == ProgressStyle::none) return;
  if (style_ == ProgressStyle::json) {
    if (!progress.frame_finished) return;
    log("{{\"frame\":{},\"total\":{},\"sim_ms\":{:.1f},\"render_ms\":{:.1f},\"encode_ms\":{:.1f},"
        "\"particles\":{},\"eta_s\":{:.1f}}}\n",
        progress.done, progress.total, progress.sim_ms, progress.render_ms, progress.encode_ms,
        progress.particles, progress.eta_s);
    return;
  }
  const auto now = steady_clock::now();
  const bool terminal = style_ == ProgressStyle::bar;
  if (last_ == steady_clock::time_point{} && !terminal) last_ = now;  // a short run needs no line in a log
  const bool complete = progress.done == progress.total && progress.frame_finished;
  if (!complete && now - last_ < (terminal ? steady_clock::duration(kTerminalInterval) : kLogInterval))
    return;
  last_ = now;
  Progress p = progress;
  p.fraction = shown_fraction_ = std::max(shown_fraction_, progress.fraction);
  if (terminal)
    show_status(progress_bar(p, terminal_width()));
  else
    log("{}\n", plain_text(p));
}

void ProgressPrinter::finish() {
  if (style_ == ProgressStyle::bar) end_status_line();
}

StepNotice::StepNotice(ProgressStyle style, std::string what)
    : style_(resolved(style)), what_(std::move(what)), thread_([this] { work(); }) {}

StepNotice::~StepNotice() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  ended_.notify_all();
  thread_.join();
  if (style_ == ProgressStyle::bar) show_status("");
}

void StepNotice::work() {
  if (style_ != ProgressStyle::bar && style_ != ProgressStyle::plain) return;
  const auto start = steady_clock::now();
  std::unique_lock lock(mutex_);
  constexpr std::chrono::milliseconds kPatience{500};  // shorter steps are not shown
  const auto ended = [&] { return end_; };
  if (style_ == ProgressStyle::plain) {
    if (!ended_.wait_for(lock, kLogInterval, ended)) log("{} ...\n", what_);
    return;
  }
  if (ended_.wait_for(lock, kPatience, ended)) return;
  do {
    const double seconds = std::chrono::duration<double>(steady_clock::now() - start).count();
    const std::string line = fmt::format("{}  {}", what_, duration_text(std::floor(seconds)));
    show_status(line.substr(0, static_cast<std::size_t>(std::max(0, terminal_width() - 1))));
  } while (!ended_.wait_for(lock, kTerminalInterval, ended));
}

}  // namespace offstage::producer
