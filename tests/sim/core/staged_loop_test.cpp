#include "sim/core/staged_loop.h"

#include <gtest/gtest.h>

namespace offstage::sim {
namespace {

struct Stage {
  uint32_t blocks;
  bool needed = true;
  uint32_t index = 0;
  uint32_t block_count() const { return blocks; }
};

// Each block reads the result of a block of the previous stage, from memory that only the loop synchronizes.
void expect_in_order(uint32_t threads) {
  std::vector<Stage> stages;
  std::vector<std::vector<uint32_t>> chain;
  for (uint32_t s = 0; s < 4000; ++s) {
    stages.push_back({s * 7 % 11, s % 5 != 3, s});
    chain.emplace_back(stages.back().blocks, 0);
  }
  // For each stage, the results of the last stage before it that ran.
  std::vector<const std::vector<uint32_t>*> before;
  const std::vector<uint32_t>* last = nullptr;
  for (const Stage& stage : stages) {
    before.push_back(last);
    if (stage.needed && stage.blocks > 0) last = &chain[stage.index];
  }
  run_stages(
      std::span<const Stage>(stages), threads, [](const Stage& stage) { return stage.needed; },
      [&](const Stage& stage, uint32_t block) {
        const auto* link = before[stage.index];
        chain[stage.index][block] += 1 + (link ? (*link)[block * 3 % link->size()] : 0);
      });
  uint32_t length = 0;
  for (const Stage& stage : stages) {
    if (stage.needed && stage.blocks > 0) ++length;
    for (const uint32_t value : chain[stage.index])
      ASSERT_EQ(value, stage.needed ? length : 0) << stage.index;
  }
}

TEST(StagedLoop, EveryBlockRunsOnceAfterAllOfTheStagesBefore) {
  for (const uint32_t threads : {1, 2, 5}) expect_in_order(threads);
}

}  // namespace
}  // namespace offstage::sim
