#pragma once
/// Many short parallel loops after each other. A parallel loop of oneTBB for each of them would cost more
/// than what it does; here the threads are called once and go from stage to stage together.

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

/// How many threads a loop here and now can get.
inline uint32_t available_threads() {
  const auto allowed = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  return std::min(static_cast<uint32_t>(allowed),
                  static_cast<uint32_t>(std::max(1, tbb::this_task_arena::max_concurrency())));
}

/// The blocks of a stage that one thread begins with, and others take from when they have no more of theirs.
/// One counter serves all stages, as they come in order.
class alignas(64) BlockShare {
 public:
  /// How many of `count` blocks of a stage were taken before this call, which takes another one; `count` if
  /// there is none left, or the stage is over.
  uint32_t take(uint32_t stage, uint32_t count) {
    uint64_t now = state_.load(std::memory_order_relaxed);
    while (true) {
      const auto at = static_cast<uint32_t>(now >> 32);
      const uint32_t taken = at == stage ? static_cast<uint32_t>(now) : 0;
      if (at > stage || taken >= count) return count;
      if (state_.compare_exchange_weak(now, uint64_t{stage} << 32 | (taken + 1), std::memory_order_relaxed))
        return taken;
    }
  }

 private:
  std::atomic<uint64_t> state_{0};  // the stage, and how many of its blocks are taken
};

/// Calls run(stage, block) for each block of each stage that is_needed(stage), a stage's only when all before
/// it are done. Stage has block_count(). What is needed may depend on the stages before, but not on its own
/// blocks. In each stage a thread begins with the same part of the blocks, of which its cache may still have
/// what it was at before, and helps others when that is done; it waits only for blocks that others are at, so
/// that it ends even if it gets no thread but its own.
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
  struct alignas(64) {
    std::atomic<uint64_t> blocks{0};
  } done;  // of all stages so far
  const auto work = [&](uint32_t thread) {
    uint64_t all = 0;
    for (uint32_t s = 0; s < stages.size(); ++s) {
      if (!is_needed(stages[s])) continue;
      const uint32_t count = stages[s].block_count();
      uint32_t mine = 0;
      for (uint32_t i = 0; i < threads; ++i) {
        const uint32_t owner = (thread + i) % threads;
        const auto begin = static_cast<uint32_t>(uint64_t{count} * owner / threads),
                   end = static_cast<uint32_t>(uint64_t{count} * (owner + 1) / threads);
        for (uint32_t taken; (taken = shares[owner].take(s, end - begin)) < end - begin; ++mine)
          run(stages[s], begin + taken);
      }
      if (mine > 0) done.blocks.fetch_add(mine, std::memory_order_release);
      all += count;
      for (uint32_t spins = 0; done.blocks.load(std::memory_order_acquire) < all; ++spins)
        spins < 1000 ? __builtin_ia32_pause() : std::this_thread::yield();
    }
  };
  tbb::parallel_for(uint32_t{0}, threads, uint32_t{1}, work, tbb::simple_partitioner());
}

}  // namespace offstage::sim
