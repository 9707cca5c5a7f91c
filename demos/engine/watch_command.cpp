#include "engine/watch_command.h"

#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "engine/simulated_film.h"
#include "producer/base/interrupt.h"
#include "producer/base/log.h"
#include "producer/cli/command_line.h"
#include "producer/cli/failure.h"
#include "producer/cli/hidden_folder.h"
#include "producer/run/output.h"
#include "producer/run/watch.h"
#include "render/error.h"

namespace offstage::engine {
namespace {

namespace fs = std::filesystem;
using producer::FileWatch;
using producer::HiddenFolder;
using producer::OutputError;
using producer::OutputKind;
using producer::RenderOptions;
using std::chrono::milliseconds;

constexpr milliseconds kStill{120};  // time without changes before files are read

/// Returns the existing files that the manifest of a folder lists.
std::set<fs::path> frames_in(const fs::path& pattern) {
  const std::vector<fs::path> files = producer::files_of_frames(pattern.parent_path());
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
  explicit Watcher(const RenderOptions& options)
      : options_(options), target_(producer::parse_output(options.out)) {
    if (options.scene.from_standard_input())
      throw OutputError("--watch needs a scene file that can change; standard input cannot");
    if (target_.kind == OutputKind::pipe)
      throw OutputError("--watch needs an output that can be replaced; standard output cannot");
    if (target_.kind == OutputKind::video) {
      producer::check_file(target_.path.string(), options.force);
    } else if (!options.force && fs::exists(folder() / "manifest.json")) {
      throw OutputError(folder().string() + ": already contains frames; replace them with --force");
    }
    producer::check_file(options.stats, options.force);
    producer::check_not_read({target_.path.string(), options.stats}, options.scene);
    if (options.cameras.size() > 1 ||
        (options.cameras.size() == 1 && options.cameras.front() == producer::kAllCameras))
      throw OutputError("--watch draws one camera; name it with --camera");
  }

  int run() {
    while (!producer::interrupt_signal()) {
      FileWatch watch(producer::files_of_scene(options_.scene.file, options_.scene.overrides()));
      watch.settle(kStill);
      if (watch.changed()) continue;  // the set of files may have changed, too
      const std::string hash =
          producer::contents_hash(producer::files_of_scene(options_.scene.file, options_.scene.overrides()));
      if (hash != rendered_) render_once(watch, hash);
      while (!watch.changed() && !producer::interrupt_signal()) watch.wait(milliseconds(1000));
    }
    if (!options_.log.quiet) producer::log("the watch has ended\n");
    return 128 + producer::interrupt_signal();
  }

 private:
  /// Renders and publishes the result, unless the files change meanwhile.
  void render_once(FileWatch& watch, const std::string& hash) {
    const HiddenFolder unfinished(beside(), "watch");
    const auto start = std::chrono::steady_clock::now();
    const std::optional<int> code = render_into(unfinished.path(), watch);
    if (!code) return;
    rendered_ = hash;
    if (*code == producer::kOk) publish(unfinished.path());
    if (options_.log.quiet) return;
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    if (*code == producer::kOk)
      producer::log("rendered in {:.1f} s; waiting for changes of the scene (Ctrl-C quits)\n",
                    seconds.count());
    else
      producer::log("{}; waiting for changes of the scene (Ctrl-C quits)\n",
                    published_ ? "kept the last good result" : "there is no result yet");
  }

  /// Returns the exit code of the render; nothing if a change or a signal ended it, because its result would
  /// be outdated.
  std::optional<int> render_into(const fs::path& folder, FileWatch& watch) {
    std::atomic<bool> changed = false;
    RenderOptions options = options_;
    options.force = true;
    options.out = (folder / target_.path.filename()).string();
    options.prints_name = false;
    options.stop = [&] { return changed || producer::interrupt_signal() != 0; };
    options.states_of = [this](const producer::LoadedScene& loaded, const producer::ModelLibrary& models,
                               int last) {
      return std::make_unique<SimulatedFilm>(loaded.scene, models, physics_,
                                             producer::simulation_key(loaded, models), last);
    };
    const std::jthread watching([&](const std::stop_token& finished) {
      while (!finished.stop_requested() && !changed) {
        watch.wait(milliseconds(20));
        changed = watch.changed();
      }
    });
    bool stopped = false;
    const int code = producer::reported([&] {
      try {
        return producer::render_command(options);
      } catch (const render::StoppedError&) {
        stopped = true;
      } catch (const producer::Interrupted&) {
        stopped = true;
      }
      return int{producer::kOk};
    });
    return stopped ? std::nullopt : std::optional(code);
  }

  /// Returns the output beside which hidden folders are placed.
  fs::path beside() const { return target_.kind == OutputKind::frames ? folder() : target_.path; }
  fs::path folder() const { return target_.path.has_parent_path() ? target_.path.parent_path() : "."; }

  /// Renames the finished files, and removes those of an earlier, longer film.
  void publish(const fs::path& made) {
    if (target_.kind == OutputKind::video) {
      // The video, and its folder of channels if it has one; those of an earlier film are removed.
      producer::remove_channels(producer::channels_folder(target_.path));
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
    producer::print_output_name(target_.path.string());
    std::fflush(stdout);
  }

  const RenderOptions& options_;
  producer::OutputTarget target_;
  PhysicsStore physics_{kPhysicsBytes};
  std::string rendered_;    // hash of the files of the last render, successful or not
  bool published_ = false;  // whether this watch has published a result
};

}  // namespace

int watch_command(const producer::RenderOptions& options) {
  return Watcher(options).run();
}

}  // namespace offstage::engine
