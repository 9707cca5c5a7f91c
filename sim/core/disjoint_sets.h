#pragma once
/// Disjoint sets (union-find) of the numbers from 0 to `count` - 1. The representative of a set, which find()
/// returns, is its smallest member.

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace offstage::sim {

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count = 0) : parent_(count) { separate(); }

  std::size_t size() const { return parent_.size(); }
  /// Makes every number a set of its own.
  void separate() { std::iota(parent_.begin(), parent_.end(), 0u); }
  uint32_t find(uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(uint32_t i, uint32_t j) {
    const uint32_t a = find(i), b = find(j);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<uint32_t> parent_;
};

}  // namespace offstage::sim
