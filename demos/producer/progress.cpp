#include "producer/progress.h"

#include <cstdio>
#include <cstdlib>
#include <string_view>

#include <fmt/format.h>
#include <unistd.h>

#include "producer/talk.h"

namespace offstage::producer {
namespace {

constexpr std::chrono::milliseconds kTerminalInterval{100};
constexpr std::chrono::seconds kLogInterval{5};

std::string text(const Progress& p) {
  return fmt::format(
      "frame {}/{}  sim {:.0f} ms  draw {:.0f} ms  encode {:.0f} ms  {} particles  {:.0f} s left", p.done,
      p.total, p.sim_ms, p.render_ms, p.encode_ms, p.particles, p.eta_s);
}

bool is_terminal() {
  const char* term = std::getenv("TERM");
  return isatty(STDERR_FILENO) && term && std::string_view(term) != "dumb";
}

}  // namespace

ProgressPrinter::ProgressPrinter(ProgressStyle style) : style_(style) {
  if (style_ == ProgressStyle::automatic && !is_terminal()) style_ = ProgressStyle::plain;
}

void ProgressPrinter::operator()(const Progress& p) {
  if (style_ == ProgressStyle::none) return;
  if (style_ == ProgressStyle::json) {
    say("{{\"frame\":{},\"total\":{},\"sim_ms\":{:.1f},\"render_ms\":{:.1f},\"encode_ms\":{:.1f},"
        "\"particles\":{},\"eta_s\":{:.1f}}}\n",
        p.done, p.total, p.sim_ms, p.render_ms, p.encode_ms, p.particles, p.eta_s);
    return;
  }
  const auto now = std::chrono::steady_clock::now();
  const bool terminal = style_ == ProgressStyle::automatic;
  if (p.done < p.total && now - last_ < (terminal ? kTerminalInterval : kLogInterval)) return;
  last_ = now;
  say("{}{}{}", terminal ? "\r\033[K" : "", text(p), terminal ? "" : "\n");
  std::fflush(stderr);
  line_open_ = terminal;
}

void ProgressPrinter::finish() {
  if (line_open_) std::fputc('\n', stderr);
  line_open_ = false;
}

}  // namespace offstage::producer
