#pragma once
/// Stores drawn frames as compressed pictures, in memory of a bounded size. If the limit is exceeded,
/// pictures of the least recently used version of the scene are removed first.

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "render/stage.h"

namespace offstage::engine {

/// Quality of a frame: draft is small, the others have full size.
enum class Detail { draft, preview, final };

struct StoredFrame {
  Detail detail = Detail::draft;
  double draw_ms = 0;
  std::shared_ptr<const std::string> jpeg;
  render::Camera camera;  ///< camera with which the frame was drawn
};

/// Pictures by film and frame. A frame can have a draft and refined pictures at the same time, because
/// playing uses the drafts. Safe from several threads.
class FrameStore {
 public:
  explicit FrameStore(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  void put(const std::string& film, int frame, StoredFrame picture);
  /// Returns the stored picture of a frame with the highest detail up to `most`; empty if there is none.
  std::optional<StoredFrame> get(const std::string& film, int frame, Detail most = Detail::final);
  bool has(const std::string& film, int frame, Detail detail) const;
  /// Returns the frames that have a draft, as ranges (first frame, last frame) in ascending order.
  std::vector<std::pair<int, int>> ranges(const std::string& film) const;
  /// Sets the films whose frames are removed only when no frames of other films are left.
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

}  // namespace offstage::engine
