#pragma once
/// The hand-over between the simulation, the drawing threads and the sink: bounded, in order, and with one
/// way to fail.

#include <condition_variable>
#include <deque>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "producer/build/snapshot.h"
#include "render/channels.h"
#include "render/image.h"

namespace offstage::producer {

/// A frame to draw. Snapshots are immutable and each serves two neighbouring frames, hence shared.
struct Shot {
  int index = 0;  // in the list of frames
  int frame = 0;
  std::shared_ptr<const Snapshot> previous, current;
  double sim_ms = 0;
  std::size_t contacts = 0;           // of bodies; without a cache
  std::optional<sim::Energy> energy;  // without a cache
};

struct Print {
  Shot shot;
  render::Image image;
  double render_ms = 0;
  render::Channels channels;  // empty unless asked for
};

/// Hands shots to the drawing threads and brings the finished frames back in order. At most `window` frames
/// are between the simulation and the sink, so memory is bounded. The first failure ends everything.
class Pipeline {
 public:
  explicit Pipeline(int window) : window_(window) {}

  /// Waits for room; false when the run has failed.
  bool push(Shot shot) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return failure_ || shot.index < next_print_ + window_; });
    if (failure_) return false;
    shots_.push_back(std::move(shot));
    changed_.notify_all();
    return true;
  }
  void no_more_shots() {
    const std::lock_guard lock(mutex_);
    all_shot_ = true;
    changed_.notify_all();
  }
  std::optional<Shot> take_shot() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return failure_ || all_shot_ || !shots_.empty(); });
    if (failure_ || shots_.empty()) return std::nullopt;
    Shot shot = std::move(shots_.front());
    shots_.pop_front();
    ++drawing_;
    return shot;
  }
  void give_print(Print print) {
    const std::lock_guard lock(mutex_);
    --drawing_;
    const int index = print.shot.index;
    prints_.emplace(index, std::move(print));
    changed_.notify_all();
  }
  /// The next finished frame in order; none when all are through or the run has failed.
  std::optional<Print> take_print() {
    std::unique_lock lock(mutex_);
    const auto ready = [&] { return !prints_.empty() && prints_.begin()->first == next_print_; };
    changed_.wait(lock,
                  [&] { return failure_ || ready() || (all_shot_ && shots_.empty() && drawing_ == 0); });
    if (failure_ || !ready()) return std::nullopt;
    Print print = std::move(prints_.begin()->second);
    prints_.erase(prints_.begin());
    ++next_print_;
    changed_.notify_all();
    return print;
  }
  void fail(std::exception_ptr error) {
    const std::lock_guard lock(mutex_);
    if (!failure_) failure_ = std::move(error);
    changed_.notify_all();
  }
  bool failed() const {
    const std::lock_guard lock(mutex_);
    return failure_ != nullptr;
  }
  /// To be called when the threads have ended.
  void rethrow_failure() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  const int window_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Shot> shots_;
  std::map<int, Print> prints_;
  int next_print_ = 0, drawing_ = 0;
  bool all_shot_ = false;
  std::exception_ptr failure_;
};

/// Runs `work`; a failure of it becomes the pipeline's.
template <class F>
void guarded(Pipeline& pipeline, F&& work) {
  try {
    work();
  } catch (...) {
    pipeline.fail(std::current_exception());
  }
}

}  // namespace offstage::producer
