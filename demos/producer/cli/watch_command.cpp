// render --watch.

#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <optional>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "producer/base/interrupt.h"
#include "producer/base/log.h"
#include "producer/cli/commands.h"
#include "producer/cli/failure.h"
#include "producer/cli/hidden_folder.h"
#include "producer/run/output.h"
#include "producer/run/watch.h"
#include "render/error.h"
#include "render/sink.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr milliseconds kStill{120};  // time without changes before files are read

/// A render in a separate process, which can be ended at any time and whose crash does not affect the watch.
class RenderProcess {
 public:
  explicit RenderProcess(const RenderOptions& options) {
    std::fflush(stdout);
    const pid_t parent = getpid();
    pid_ = fork();
    if (pid_ < 0) throw render::FileError("the render could not be started");
    if (pid_ == 0) become_render(options, parent);
  }
  ~RenderProcess() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  RenderProcess(const RenderProcess&) = delete;
  RenderProcess& operator=(const RenderProcess&) = delete;

  /// Its exit code, or -1 if it crashed; nothing while it runs.
  std::optional<int> result() {
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) != pid_) return {};
    pid_ = -1;
    if (WIFEXITED(status)) return WEXITSTATUS(status);
    log("offstage: the render was ended by signal {}\n", WTERMSIG(status));
    return -1;
  }

 private:
  [[noreturn]] static void become_render(const RenderOptions& options, pid_t parent) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(1);
    // The watch handles Ctrl-C and ends this process. The printed name of its result would be a temporary
    // one.
    std::signal(SIGINT, SIG_IGN);
    std::signal(SIGTERM, SIG_IGN);
    if (const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC); nowhere >= 0)
      dup2(nowhere, STDOUT_FILENO);
    const int code = reported([&] { return render_command(options); });
    std::fflush(stdout);
    _exit(code);
  }

  pid_t pid_ = -1;
};

/// The existing files that the manifest of a folder lists.
std::set<fs::path> frames_in(const fs::path& pattern) {
  const std::vector<fs::path> files = files_of_frames(pattern.parent_path());
  return {files.begin(), files.end()};
}

/// Moves channel files into their folder, from which old ones were removed.
void publish_channels(const fs::path& made, const fs::path& place) {
  fs::create_directories(place);
  for (const auto& entry : fs::directory_iterator(made))
    fs::rename(entry.path(), place / entry.path().filename());
}

class Watcher {
 public:
  explicit Watcher(const RenderOptions& options) : options_(options), target_(parse_output(options.out)) {
    if (options.scene.from_standard_input())
      throw OutputError("--watch needs a scene file that can change; standard input cannot");
    if (target_.kind == OutputKind::pipe)
      throw OutputError("--watch needs an output that can be replaced; standard output cannot");
    if (target_.kind == OutputKind::video) {
      check_file(target_.path.string(), options.force);
    } else if (!options.force && fs::exists(folder() / "manifest.json")) {
      throw OutputError(folder().string() + ": already contains frames; replace them with --force");
    }
    check_file(options.stats, options.force);
    if (options.cache.empty()) states_.emplace(beside(), "states");
  }

  int run() {
    while (!interrupt_signal()) {
      FileWatch watch(files_of_scene(options_.scene.file, options_.scene.overrides()));
      watch.settle(kStill);
      if (watch.changed()) continue;  // the set of files may have changed, too
      const std::string hash = contents_hash(files_of_scene(options_.scene.file, options_.scene.overrides()));
      if (hash != rendered_) render_once(watch, hash);
      while (!watch.changed() && !interrupt_signal()) watch.wait(milliseconds(1000));
    }
    if (!options_.talk.quiet) log("the watch has ended\n");
    return 128 + interrupt_signal();
  }

 private:
  /// Renders unless the files change meanwhile, which would make the result outdated.
  void render_once(FileWatch& watch, const std::string& hash) {
    const HiddenFolder unfinished(beside(), "watch");
    RenderOptions options = options_;
    options.watch = false;
    options.force = true;
    options.out = (unfinished.path() / target_.path.filename()).string();
    if (states_) options.states = states_->path().string();
    const auto start = std::chrono::steady_clock::now();
    RenderProcess process(options);
    std::optional<int> code;
    while (!(code = process.result())) {
      watch.wait(milliseconds(20));
      if (interrupt_signal() || watch.changed()) return;
    }
    rendered_ = hash;
    if (*code == 0) publish(unfinished.path());
    if (options_.talk.quiet) return;
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    if (*code == 0)
      log("rendered in {:.1f} s; waiting for changes of the scene (Ctrl-C quits)\n", seconds.count());
    else
      log("{}; waiting for changes of the scene (Ctrl-C quits)\n",
          published_ ? "kept the last good result" : "there is no result yet");
  }

  /// The output beside which hidden folders are placed.
  fs::path beside() const { return target_.kind == OutputKind::frames ? folder() : target_.path; }
  fs::path folder() const { return target_.path.has_parent_path() ? target_.path.parent_path() : "."; }

  /// Renames the finished files, and removes those of an earlier, longer film.
  void publish(const fs::path& made) {
    if (target_.kind == OutputKind::video) {
      // The video, and its folder of channels if it has one; those of an earlier film are removed.
      remove_channels(channels_folder(target_.path));
      for (const auto& entry : fs::directory_iterator(made)) {
        const fs::path place = folder() / entry.path().filename();
        if (entry.is_directory())
          publish_channels(entry.path(), place);
        else
          fs::rename(entry.path(), place);
      }
    } else {
      fs::create_directories(folder());
      std::set<fs::path> stale = frames_in(target_.path);
      for (const auto& entry : fs::directory_iterator(made)) {
        const fs::path place = target_.path.parent_path() / entry.path().filename();
        fs::rename(entry.path(), place);
        stale.erase(place);
      }
      for (const fs::path& path : stale) fs::remove(path);
    }
    published_ = true;
    print_output_name(target_.path.string());
    std::fflush(stdout);
  }

  const RenderOptions& options_;
  OutputTarget target_;
  std::optional<HiddenFolder> states_;  // of the latest simulation, for renders that change only its look
  std::string rendered_;                // hash of the files of the last render, successful or not
  bool published_ = false;              // whether this watch has published a result
};

}  // namespace

int watch_command(const RenderOptions& options) {
  return Watcher(options).run();
}

}  // namespace offstage::producer
