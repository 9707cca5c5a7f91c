#pragma once
/// Asking for memory before it is wanted: what lies in no order is fetched while other work goes on.

#include <cstddef>

namespace offstage::sim {

/// Asks for `size` bytes from `begin` on.
inline void prefetch(const void* begin, std::size_t size) {
  constexpr std::size_t kLine = 64;
  for (std::size_t i = 0; i < size; i += kLine) __builtin_prefetch(static_cast<const char*>(begin) + i);
}

}  // namespace offstage::sim
