#pragma once
/// Many short parallel loops after each other. A parallel loop of oneTBB for each of them would cost more
/// than what it does; here the threads are called once and go from stage to stage together.

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <thread>

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

/// Calls run(stage, block) for each block of each stage that is_needed(stage), a stage's only when all before
/// it are done. Stage has block_count(). What is needed may depend on the stages before, but not on its own
/// blocks. Threads take the blocks of a stage as they come; one waits only for blocks that others are at, so
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
  struct alignas(64) Progress {
    std::atomic<uint32_t> taken{0}, done{0};
  };
  const auto progress = std::make_unique<Progress[]>(stages.size());
  tbb::parallel_for(
      uint32_t{0}, threads, uint32_t{1},
      [&](uint32_t) {
        for (std::size_t s = 0; s < stages.size(); ++s) {
          if (!is_needed(stages[s])) continue;
          const uint32_t count = stages[s].block_count();
          uint32_t mine = 0;
          for (uint32_t block; (block = progress[s].taken.fetch_add(1, std::memory_order_relaxed)) < count;
               ++mine)
            run(stages[s], block);
          if (mine > 0) progress[s].done.fetch_add(mine, std::memory_order_release);
          for (uint32_t spins = 0; progress[s].done.load(std::memory_order_acquire) < count; ++spins)
            spins < 1000 ? __builtin_ia32_pause() : std::this_thread::yield();
        }
      },
      tbb::simple_partitioner());
}

}  // namespace offstage::sim
