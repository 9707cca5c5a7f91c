#pragma once
/// Loops over things that do not depend on each other.

#include <cstddef>

#include <oneapi/tbb/parallel_for.h>

namespace offstage::sim {

/// Calls work(i) for each i below `count`, on several threads if there are enough. Each call may write to
/// what belongs to its i alone.
template <class Work>
void for_each_index(std::size_t count, Work&& work) {
  constexpr std::size_t kWorthThreads = 256, kBlock = 64;
  if (count < kWorthThreads) {
    for (std::size_t i = 0; i < count; ++i) work(i);
    return;
  }
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, kBlock), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) work(i);
  });
}

}  // namespace offstage::sim
