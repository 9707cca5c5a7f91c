#pragma once
/// A film for a consumer that asks for one frame after another: simulation and drawing run ahead of it on a
/// thread of their own.

#include <condition_variable>
#include <deque>
#include <exception>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "producer/build/models.h"
#include "producer/build/snapshot.h"
#include "producer/format/scene_io.h"
#include "render/channels.h"
#include "render/context.h"
#include "render/image.h"

namespace offstage::python {

/// A scene that was read, with its models. It never changes, so simulations and films share it.
struct SharedScene {
  producer::LoadedScene loaded;
  producer::ModelLibrary models;
};

struct FilmJob {
  std::vector<int> frames;                     ///< ascending
  bool images = true;                          ///< false: states and channels alone
  bool channels = false;                       ///< depth, normals, ids and motion
  std::optional<std::filesystem::path> cache;  ///< states from here instead of a simulation
};

struct FilmFrame {
  int number = 0;
  double time_s = 0;
  std::optional<render::Image> image;
  std::optional<render::Channels> channels;
  std::shared_ptr<const producer::Snapshot> snapshot;
};

class Film {
 public:
  Film(std::shared_ptr<const SharedScene> scene, FilmJob job);
  /// Ends the work; a frame that is being drawn is finished first.
  ~Film();

  /// Waits for the next frame; none at the end, or after cancel(). Throws what the simulation or the drawing
  /// threw.
  std::optional<FilmFrame> next();
  void cancel();
  int total() const { return static_cast<int>(job_.frames.size()); }
  int done() const;  ///< frames that were taken

 private:
  static constexpr std::size_t kAhead = 3;  // frames that wait for the consumer

  void produce();
  bool push(FilmFrame frame);
  bool cancelled() const;

  std::shared_ptr<const SharedScene> scene_;
  FilmJob job_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<FilmFrame> ready_;
  std::exception_ptr failure_;
  bool ended_ = false, cancelled_ = false;
  int done_ = 0;
  std::jthread worker_;  // last: it uses the others
};

/// Chooses the OpenGL implementation of the process; only the first call counts.
void pin_environment_once(int threads, render::GlPlatform platform);

}  // namespace offstage::python
