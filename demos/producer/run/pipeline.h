#pragma once
/// The queue between the simulation, the drawing threads and the sink. It limits the number of frames in
/// memory, returns them in order, and handles failures in one place.

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

/// A frame to draw. Two neighbouring frames use the same snapshot, so snapshots are shared and never change.
struct FrameJob {
  int index = 0;  // index in the list of frames
  int frame = 0;
  std::shared_ptr<const Snapshot> previous, current;
  double sim_ms = 0;
  std::size_t contacts = 0;           // contacts of bodies; 0 with a cache
  std::optional<sim::Energy> energy;  // empty with a cache
};

struct RenderedFrame {
  FrameJob frame_job;
  render::Image image;
  double render_ms = 0;
  render::Channels channels;  // empty unless requested
  render::HdrImage linear;    // empty unless the sink needs it
  render::LightSums light;    // sums of light in this frame
};

/// Passes frames to the drawing threads and returns the finished frames in order. At most `window` frames are
/// between the simulation and the sink, so the memory is bounded. The first failure ends the run.
class Pipeline {
 public:
  explicit Pipeline(int window) : window_(window) {}

  /// Adds a frame to draw. Waits until there is room in the window. Returns false if the run has failed.
  bool push(FrameJob frame_job) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return failure_ || frame_job.index < next_rendered_ + window_; });
    if (failure_) return false;
    jobs_.push_back(std::move(frame_job));
    changed_.notify_all();
    return true;
  }
  /// Must be called when no further frames will be added. Ends the waits for further frames.
  void finish_jobs() {
    const std::lock_guard lock(mutex_);
    all_produced_ = true;
    changed_.notify_all();
  }
  /// Waits for the next frame to draw and returns it; nothing if there are no more frames or the run has
  /// failed.
  std::optional<FrameJob> take_job() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return failure_ || all_produced_ || !jobs_.empty(); });
    if (failure_ || jobs_.empty()) return std::nullopt;
    FrameJob frame_job = std::move(jobs_.front());
    jobs_.pop_front();
    ++drawing_;
    return frame_job;
  }
  void give_rendered(RenderedFrame rendered) {
    const std::lock_guard lock(mutex_);
    --drawing_;
    const int index = rendered.frame_job.index;
    rendered_.emplace(index, std::move(rendered));
    changed_.notify_all();
  }
  /// Waits for the next finished frame, in order, and returns it; nothing after the last frame or if the run
  /// has failed.
  std::optional<RenderedFrame> take_rendered() {
    std::unique_lock lock(mutex_);
    const auto ready = [&] { return !rendered_.empty() && rendered_.begin()->first == next_rendered_; };
    changed_.wait(lock,
                  [&] { return failure_ || ready() || (all_produced_ && jobs_.empty() && drawing_ == 0); });
    if (failure_ || !ready()) return std::nullopt;
    RenderedFrame rendered = std::move(rendered_.begin()->second);
    rendered_.erase(rendered_.begin());
    ++next_rendered_;
    changed_.notify_all();
    return rendered;
  }
  /// Ends the run with an exception. Only the first exception is stored.
  void fail(std::exception_ptr error) {
    const std::lock_guard lock(mutex_);
    if (!failure_) failure_ = std::move(error);
    changed_.notify_all();
  }
  bool failed() const {
    const std::lock_guard lock(mutex_);
    return failure_ != nullptr;
  }
  /// Throws the first exception passed to fail(), if any. Must be called after the threads have ended.
  void rethrow_failure() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  const int window_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<FrameJob> jobs_;
  std::map<int, RenderedFrame> rendered_;
  int next_rendered_ = 0, drawing_ = 0;
  bool all_produced_ = false;
  std::exception_ptr failure_;
};

/// Runs `work`. An exception that it throws is passed to Pipeline::fail(), which ends the run.
template <class F>
void guarded(Pipeline& pipeline, F&& work) {
  try {
    work();
  } catch (...) {
    pipeline.fail(std::current_exception());
  }
}

}  // namespace offstage::producer
