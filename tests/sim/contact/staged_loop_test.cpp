#include "sim/contact/staged_loop.h"

#include <atomic>

#include <gtest/gtest.h>

namespace offstage::sim {
namespace {

struct Stage {
  uint32_t blocks;
  bool needed = true;
  uint32_t block_count() const { return blocks; }
};

// Each block counts, and remembers how many were done before: of its own stage some, of those before all.
void expect_in_order(uint32_t threads) {
  std::vector<Stage> stages;
  for (uint32_t s = 0; s < 4000; ++s) stages.push_back({s * 7 % 11, s % 5 != 3});
  std::vector<std::vector<uint32_t>> runs(stages.size()), before(stages.size());
  for (std::size_t s = 0; s < stages.size(); ++s) {
    runs[s].assign(stages[s].blocks, 0);
    before[s].assign(stages[s].blocks, 0);
  }
  std::atomic<uint32_t> done{0};
  const std::span<const Stage> all(stages);
  run_stages(
      all, threads, [](const Stage& stage) { return stage.needed; },
      [&](const Stage& stage, uint32_t block) {
        const auto s = static_cast<std::size_t>(&stage - stages.data());
        before[s][block] = done.load(std::memory_order_relaxed);
        ++runs[s][block];
        done.fetch_add(1, std::memory_order_relaxed);
      });
  uint32_t count = 0;
  for (std::size_t s = 0; s < stages.size(); ++s) {
    for (uint32_t b = 0; b < stages[s].blocks; ++b) {
      ASSERT_EQ(runs[s][b], stages[s].needed) << s << ' ' << b;
      if (!stages[s].needed) continue;
      ASSERT_GE(before[s][b], count) << s << ' ' << b;
      ASSERT_LT(before[s][b], count + stages[s].blocks) << s << ' ' << b;
    }
    if (stages[s].needed) count += stages[s].blocks;
  }
}

TEST(StagedLoop, EveryBlockRunsOnceAfterAllOfTheStagesBefore) {
  for (const uint32_t threads : {1, 2, 5}) expect_in_order(threads);
}

}  // namespace
}  // namespace offstage::sim
