#pragma once
/// What has been simulated and drawn, in memory of a stated size: states of the latest simulations, and
/// compressed pictures of the latest versions of a scene. Both forget what was used longest ago.

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "producer/build/snapshot.h"
#include "producer/run/production.h"

namespace offstage::tune {

/// How well a frame is drawn: draft small, the others at full size.
enum class Detail { draft, preview, final };

struct StoredFrame {
  Detail detail = Detail::draft;
  double draw_ms = 0;
  std::shared_ptr<const std::string> jpeg;
  render::Camera camera;  ///< that it was seen by
};

/// Pictures by film and frame; a better one replaces a draft's place when it is asked for, and the draft
/// stays for playing. Any thread may call.
class FrameStore {
 public:
  explicit FrameStore(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  void put(const std::string& film, int frame, StoredFrame picture);
  /// The picture of a frame with at most this detail, the best there is.
  std::optional<StoredFrame> get(const std::string& film, int frame, Detail most = Detail::final);
  bool has(const std::string& film, int frame, Detail detail) const;
  /// Frames with a draft, as first and last of each run of neighbours.
  std::vector<std::pair<int, int>> ranges(const std::string& film) const;
  /// These films are forgotten last.
  void protect(std::vector<std::string> films);
  std::size_t bytes() const;
  std::size_t most_bytes() const { return most_bytes_; }

 private:
  struct Film {
    std::map<std::pair<int, Detail>, StoredFrame> frames;
    std::size_t bytes = 0;
    uint64_t used = 0;
  };
  void make_room();

  const std::size_t most_bytes_;
  mutable std::mutex mutex_;
  std::map<std::string, Film> films_;
  std::vector<std::string> protected_;
  std::size_t bytes_ = 0;
  uint64_t clock_ = 0;
};

/// The states of one simulation, as far as it went.
struct Physics {
  std::vector<std::shared_ptr<const producer::Snapshot>> states;  ///< from frame 1; null: not kept
  std::vector<producer::FrameFigures> figures;                    ///< from frame 1
  std::string statistics;                                         ///< JSON, when the film is complete
  std::vector<std::string> notes;  ///< what went wrong on the way, as sentences
};

/// Simulations by key. The one in use is never forgotten, but its states beyond the bound are not kept: they
/// are simulated again when they are asked for. For one thread.
class PhysicsStore {
 public:
  explicit PhysicsStore(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  std::shared_ptr<Physics> open(const std::string& key);
  void keep(const std::string& key, int frame, std::shared_ptr<const producer::Snapshot> state);
  std::size_t bytes() const { return bytes_; }

 private:
  struct Entry {
    std::string key;
    std::shared_ptr<Physics> physics;
    std::size_t bytes = 0;
  };
  const std::size_t most_bytes_;
  std::list<Entry> entries_;  // latest first
  std::size_t bytes_ = 0;
};

}  // namespace offstage::tune
