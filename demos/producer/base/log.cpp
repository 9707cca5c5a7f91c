#include "producer/base/log.h"

#include <atomic>
#include <cstdio>
#include <mutex>

#include <sys/ioctl.h>
#include <unistd.h>

namespace offstage::producer {
namespace {

std::mutex talk_mutex;
bool status_shown = false;
std::atomic<bool> output_closed = false;

constexpr std::string_view kClearLine = "\r\033[K";

void write_to_stderr(const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stderr);
  std::fflush(stderr);
}

}  // namespace

void print_output_name(const std::string& name) {
  if (!output_closed) fmt::print("{}\n", name);
}

void note_closed_output() {
  output_closed = true;
}

void write_log(std::string_view lines) {
  const std::lock_guard lock(talk_mutex);
  write_to_stderr(std::string(std::exchange(status_shown, false) ? kClearLine : "") + std::string(lines));
}

void show_status(std::string_view line) {
  const std::lock_guard lock(talk_mutex);
  if (line.empty() && !status_shown) return;
  write_to_stderr(std::string(kClearLine) + std::string(line));
  status_shown = !line.empty();
}

void end_status_line() {
  const std::lock_guard lock(talk_mutex);
  if (std::exchange(status_shown, false)) write_to_stderr("\n");
}

int terminal_width() {
  constexpr int kUsual = 80;
  winsize size{};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : kUsual;
}

}  // namespace offstage::producer
