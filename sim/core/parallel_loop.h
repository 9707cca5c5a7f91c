#pragma once
/// Parallel loops over independent items.

#include <cstddef>
#include <cstdint>
#include <vector>

#include <oneapi/tbb/parallel_for.h>

namespace offstage::sim {

/// Calls work(i) for each i below `count`, on several threads if `count` is large enough. Each call may write
/// only to data that belongs to its i.
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

/// Returns the numbers i below `count` for which is_wanted(i) is true, in ascending order. is_wanted() is
/// called in parallel, as for_each_index() does.
template <class Predicate>
std::vector<std::size_t> indices_where(std::size_t count, Predicate&& is_wanted) {
  std::vector<uint8_t> wanted(count);
  for_each_index(count, [&](std::size_t i) { wanted[i] = is_wanted(i); });
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < count; ++i)
    if (wanted[i]) result.push_back(i);
  return result;
}

}  // namespace offstage::sim
