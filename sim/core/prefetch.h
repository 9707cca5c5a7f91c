#pragma once
/// Asking for memory before it is wanted: what lies in no order is fetched while other work goes on.

#include <cstddef>

namespace offstage::sim {

/// Asks for the lines of the caches that lie from `begin` to `end`.
inline void prefetch(const void* begin, const void* end) {
  constexpr std::size_t kLine = 64;
  for (auto* p = static_cast<const char*>(begin); p < end; p += kLine) __builtin_prefetch(p);
}

}  // namespace offstage::sim
