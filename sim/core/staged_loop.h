#pragma once
/// A sequence of many short parallel loops. A parallel loop of oneTBB for each of them would cost more than
/// its work. Therefore the threads are started once, and go from stage to stage together.

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <span>
#include <thread>
#include <vector>

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

namespace offstage::sim {

/// Returns how many threads a loop can get at this point of the program.
inline uint32_t available_threads() {
  const auto allowed = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  return std::min(static_cast<uint32_t>(allowed),
                  static_cast<uint32_t>(std::max(1, tbb::this_task_arena::max_concurrency())));
}

/// The share of a stage's blocks that one thread processes first. Other threads take blocks from it when
/// their own shares are finished. Stages are processed in order, so one counter is sufficient for all of
/// them. The whole shared state is in one cache line; transferring this line between cores is the only
/// overhead of a stage.
class alignas(64) BlockShare {
 public:
  /// Takes one block of a stage. Returns its index in this share, from 0 to `count` - 1, or `count` if no
  /// block is left.
  uint32_t take(uint32_t stage, uint32_t count) {
    uint64_t now = state_.load(std::memory_order_relaxed);
    while (true) {
      const State state = unpacked(now);
      const uint32_t taken = state.stage == stage ? state.taken : 0;
      if (state.stage > stage || taken >= count) return count;
      const uint64_t next = state.stage == stage ? now + kTaken : uint64_t{stage} << kStageBit | kTaken;
      if (state_.compare_exchange_weak(now, next, std::memory_order_relaxed)) return taken;
    }
  }

  /// Marks a block that was taken as done.
  void finish() { state_.fetch_add(kDone, std::memory_order_release); }

  /// Whether all `count` blocks of a stage are done.
  bool is_done(uint32_t stage, uint32_t count) const {
    const State state = unpacked(state_.load(std::memory_order_acquire));
    return count == 0 || state.stage > stage || (state.stage == stage && state.done == count);
  }

 private:
  static constexpr uint32_t kBlockBits = 20, kStageBit = 2 * kBlockBits;
  static constexpr uint64_t kDone = 1, kTaken = uint64_t{1} << kBlockBits;
  struct State {
    uint32_t stage, taken, done;
  };
  static State unpacked(uint64_t s) {
    return {static_cast<uint32_t>(s >> kStageBit), static_cast<uint32_t>(s / kTaken % kTaken),
            static_cast<uint32_t>(s % kTaken)};
  }

  std::atomic<uint64_t> state_{0};  // stage, number of its blocks taken, number done
};

/// Calls run(stage, block) for each block of each stage for which is_needed(stage) is true. A stage begins
/// when all blocks of the stages before it are done. `Stage` must have a function block_count(). is_needed()
/// may depend on the stages before, but not on the blocks of the same stage. In each stage a thread begins
/// with the same part of the blocks, whose data may still be in its cache, and then helps other threads. It
/// waits only for blocks that are in progress, so the loop ends even if no other thread joins. Limits: 16
/// million stages, and a million blocks for each thread.
template <class Stage, class IsNeeded, class Run>
void run_stages(std::span<Stage> stages, uint32_t threads, IsNeeded&& is_needed, Run&& run) {
  if (threads == 1) {
    for (Stage& stage : stages) {
      if (!is_needed(stage)) continue;
      for (uint32_t block = 0, count = stage.block_count(); block < count; ++block) run(stage, block);
    }
    return;
  }
  std::vector<BlockShare> shares(threads);
  const auto work = [&](uint32_t thread) {
    for (uint32_t s = 0; s < stages.size(); ++s) {
      if (!is_needed(stages[s])) continue;
      const uint64_t count = stages[s].block_count();
      const auto begin = [&](uint32_t owner) { return static_cast<uint32_t>(count * owner / threads); };
      for (uint32_t i = 0; i < threads; ++i) {
        const uint32_t owner = (thread + i) % threads, first = begin(owner), mine = begin(owner + 1) - first;
        for (uint32_t taken; (taken = shares[owner].take(s, mine)) < mine;) {
          run(stages[s], first + taken);
          shares[owner].finish();
        }
      }
      for (uint32_t owner = 0; owner < threads; ++owner)
        for (uint32_t spins = 0; !shares[owner].is_done(s, begin(owner + 1) - begin(owner)); ++spins)
          spins < 1000 ? __builtin_ia32_pause() : std::this_thread::yield();
    }
  };
  tbb::parallel_for(uint32_t{0}, threads, uint32_t{1}, work, tbb::simple_partitioner());
}

}  // namespace offstage::sim
