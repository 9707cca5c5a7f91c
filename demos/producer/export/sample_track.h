#pragma once
/// Values over frames, stored only where they change.

#include <utility>
#include <vector>

namespace offstage::producer {

/// The samples of one value. Other programs interpolate between samples. A value that was constant therefore
/// gets an additional sample at the last frame before it changes.
template <class T>
class SampleTrack {
 public:
  /// Must be called with ascending frames.
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
  /// Whether the value never changes.
  bool constant() const { return samples_.size() == 1; }

 private:
  std::vector<std::pair<int, T>> samples_;
  int latest_ = 0;
};

}  // namespace offstage::producer
