#pragma once
/// Connected pieces of cloth. Springs connect points permanently; other connections are temporary.

#include <cstdint>
#include <numeric>
#include <vector>

#include "sim/core/disjoint_sets.h"

namespace offstage::sim {

class ClothPieces {
 public:
  /// Makes every point a piece of its own.
  void assign(std::size_t points) {
    number_.resize(points);
    std::iota(number_.begin(), number_.end(), 0u);
    sets_ = DisjointSets(points);
  }
  void join(uint32_t point, uint32_t other) { sets_.join(number_[point], number_[other]); }
  /// Makes the current connections permanent and renumbers the pieces. Later connections last until forget().
  void keep() {
    std::vector<uint32_t> number(sets_.size());
    uint32_t count = 0;
    for (uint32_t k = 0; k < sets_.size(); ++k)
      number[k] = sets_.find(k) == k ? count++ : number[sets_.find(k)];  // representatives come first
    for (uint32_t& n : number_) n = number[n];
    sets_ = DisjointSets(count);
  }
  void forget() { sets_.separate(); }

  /// Returns the index of the piece that contains a point, less than count().
  uint32_t of(uint32_t point) { return sets_.find(number_[point]); }
  std::size_t count() const { return sets_.size(); }

 private:
  std::vector<uint32_t> number_;  // by point: the piece that contains it, as of the last keep()
  DisjointSets sets_;             // pieces that later connections join
};

}  // namespace offstage::sim
