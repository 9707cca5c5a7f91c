#pragma once
/// Prefetching: loads data with an irregular access pattern into the cache while other work continues.

#include <cstddef>

namespace offstage::sim {

/// Prefetches the cache lines from `begin` to `end`.
inline void prefetch(const void* begin, const void* end) {
  constexpr std::size_t kLine = 64;
  for (auto* p = static_cast<const char*>(begin); p < end; p += kLine) __builtin_prefetch(p);
}

}  // namespace offstage::sim
