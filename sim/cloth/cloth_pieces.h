#pragma once
/// Connected pieces of cloth: points connected permanently by springs, and temporarily by other connections.

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace offstage::sim {

class ClothPieces {
 public:
  /// Makes every point a piece of its own.
  void assign(std::size_t points) {
    number_.resize(points);
    parent_.resize(points);
    std::iota(number_.begin(), number_.end(), 0u);
    parent_ = number_;
  }
  void join(uint32_t point, uint32_t other) {
    const uint32_t a = of(point), b = of(other);
    parent_[std::max(a, b)] = std::min(a, b);
  }
  /// Makes the current connections permanent and renumbers the pieces. Later connections last until forget().
  void keep() {
    std::vector<uint32_t> number(parent_.size());
    uint32_t count = 0;
    for (uint32_t k = 0; k < parent_.size(); ++k)
      number[k] = parent_[k] == k ? count++ : number[parent_[k]];  // parents come first
    for (uint32_t& n : number_) n = number[n];
    parent_.resize(count);
    forget();
  }
  void forget() { std::iota(parent_.begin(), parent_.end(), 0u); }

  /// The number of a point's piece, less than count().
  uint32_t of(uint32_t point) {
    uint32_t k = number_[point];
    while (parent_[k] != k) k = parent_[k] = parent_[parent_[k]];
    return k;
  }
  std::size_t count() const { return parent_.size(); }

 private:
  std::vector<uint32_t> number_;  // of the piece of each point, as kept
  std::vector<uint32_t> parent_;  // of each piece: one that it is joined to, or itself
};

}  // namespace offstage::sim
