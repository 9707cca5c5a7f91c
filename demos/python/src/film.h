#pragma once
/// A film whose frames are taken one by one by the caller. A separate thread simulates and draws a few frames
/// ahead.

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

/// A loaded scene with its models. It is immutable, so simulations and films can share it.
struct SharedScene {
  producer::LoadedScene loaded;
  producer::ModelLibrary models;
};

struct FilmJob {
  std::vector<int> frames;  ///< ascending
  bool images = true;       ///< whether frames have pictures; false: only states and channels
  bool channels = false;    ///< whether frames have the channels depth, normals, ids and motion
  std::optional<std::filesystem::path> cache;  ///< folder from which states are read instead of simulating
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
  /// Cancels the film and waits until the frame in progress is finished.
  ~Film();

  /// Waits for the next frame and returns it; nothing after the last frame or after cancel(). Throws the
  /// exceptions of the simulation and the drawing.
  std::optional<FilmFrame> next();
  void cancel();
  int total() const { return static_cast<int>(job_.frames.size()); }
  int done() const;  ///< number of frames that the caller has taken

 private:
  static constexpr std::size_t kAhead = 3;  // greatest number of finished frames that wait for the caller

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
  std::jthread worker_;  // declared last, because it uses the other members
};

/// Selects the OpenGL implementation of the process; only the first call has an effect.
void pin_environment_once(int threads, render::GlPlatform platform);

}  // namespace offstage::python
