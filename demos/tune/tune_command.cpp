#include "tune/tune_command.h"

#include <cstdio>
#include <cstdlib>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include "producer/base/interrupt.h"
#include "producer/base/log.h"
#include "producer/cli/command_line.h"
#include "render/context.h"
#include "tune/http_server.h"
#include "tune/session.h"

namespace offstage::tune {
namespace {

/// Opens the address in the desktop's browser, if there is one. The browser is not a child of this process.
void open_browser(const std::string& address) {
  if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY")) return;
  const pid_t child = fork();
  if (child < 0) return;
  if (child == 0) {
    if (fork() != 0) _exit(0);
    setsid();
    const int nowhere = open("/dev/null", O_RDWR);
    for (int fd = 0; fd <= 2; ++fd) dup2(nowhere, fd);
    execlp("xdg-open", "xdg-open", address.c_str(), static_cast<char*>(nullptr));
    _exit(127);
  }
  waitpid(child, nullptr, 0);
}

Eigen::Vector2i size_of(const std::string& text) {
  int width = 0, height = 0, end = 0;
  if (std::sscanf(text.c_str(), "%dx%d%n", &width, &height, &end) != 2 ||
      text[static_cast<std::size_t>(end)] || width < 64 || height < 64 || width > 1920 || height > 1920)
    throw std::invalid_argument("--size must be WIDTHxHEIGHT from 64x64 to 1920x1920, got " + text);
  return {width, height};
}

}  // namespace

int tune_command(const producer::TuneOptions& options) {
  if (options.scene.from_standard_input())
    throw std::invalid_argument(
        "tune needs a scene file, because it saves changes; standard input cannot be used");
  engine::EngineSettings settings;
  settings.draft_px = size_of(options.size);
  settings.decompositions = options.scene.decompositions();
  const auto threads = producer::simulation_threads(options.threads);
  render::pin_environment(producer::threads_or_all(options.threads), options.gl);
  render::Context();  // reports a missing library before the address is printed
  Session session(options.scene.file, std::move(settings), options.scene.allow);
  const HttpServer server(session, options.port);
  fmt::print("{}\n", server.address());
  std::fflush(stdout);
  producer::log("tuning {}; Ctrl-C ends\n", options.scene.file);
  if (options.open) open_browser(server.address());
  while (!producer::interrupt_signal()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  return 128 + producer::interrupt_signal();
}

}  // namespace offstage::tune
