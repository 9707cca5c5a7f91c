#pragma once
/// Stores values over frames, but only at frames where they change.

#include <utility>
#include <vector>

namespace offstage::producer {

/// The samples of one value over the frames. Other programs interpolate between samples. If a value changes
/// after it was constant, there is therefore an additional sample at the last frame before the change.
template <class T>
class SampleTrack {
 public:
  /// Adds the value at a frame. Frames must be in ascending order.
  void add(int frame, const T& value) {
    if (samples_.empty()) {
      samples_.emplace_back(frame, value);
    } else if (!(samples_.back().second == value)) {
      const auto [last, rest] = samples_.back();
      if (last != latest_) samples_.emplace_back(latest_, rest);
      samples_.emplace_back(frame, value);
    }
    latest_ = frame;
  }
  const std::vector<std::pair<int, T>>& samples() const { return samples_; }
  /// Returns whether the value is the same at all frames.
  bool constant() const { return samples_.size() == 1; }

 private:
  std::vector<std::pair<int, T>> samples_;
  int latest_ = 0;
};

}  // namespace offstage::producer
