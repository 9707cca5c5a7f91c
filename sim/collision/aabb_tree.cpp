#include "sim/collision/aabb_tree.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace offstage::sim {
namespace {

constexpr std::size_t kLeafItems = 4;

}  // namespace

AabbTree::AabbTree(std::span<const Aabb> boxes) : items_(boxes.size()) {
  std::iota(items_.begin(), items_.end(), 0u);
  if (boxes.empty()) return;
  nodes_.reserve(boxes.size());
  build(boxes, 0, boxes.size());
}

void AabbTree::build(std::span<const Aabb> boxes, std::size_t begin, std::size_t end) {
  const std::size_t self = nodes_.size();
  nodes_.emplace_back();
  Aabb box;
  for (std::size_t i = begin; i < end; ++i) box.extend(boxes[items_[i]]);
  const std::size_t middle = end - begin > kLeafItems ? split(boxes, begin, end) : begin;
  if (middle == begin) {
    nodes_[self].first = static_cast<uint32_t>(begin);
    nodes_[self].count = static_cast<uint32_t>(end - begin);
  } else {
    build(boxes, begin, middle);
    build(boxes, middle, end);
  }
  nodes_[self].box = box;
  nodes_[self].next = static_cast<uint32_t>(nodes_.size());
}

/// Reorders items_[begin, end) and returns where its second half starts; `begin` if nothing separates them.
std::size_t AabbTree::split(std::span<const Aabb> boxes, std::size_t begin, std::size_t end) {
  const auto first = items_.begin() + static_cast<std::ptrdiff_t>(begin);
  const auto last = items_.begin() + static_cast<std::ptrdiff_t>(end);
  const auto size = last - first;

  Aabb centres;
  for (auto it = first; it != last; ++it) centres.extend(boxes[*it].center());
  const Vec3 extent = centres.sizes();
  std::array<int, 3> axes = {0, 1, 2};
  std::stable_sort(axes.begin(), axes.end(), [&](int a, int b) { return extent[a] > extent[b]; });

  for (int axis : axes) {
    if (!(extent[axis] > 0)) break;
    const auto centre = [&](uint32_t i) { return boxes[i].center()[axis]; };
    Real mean = 0;
    for (auto it = first; it != last; ++it) mean += centre(*it);
    mean /= static_cast<Real>(size);
    auto middle = std::partition(first, last, [&](uint32_t i) { return centre(i) < mean; });
    // A lopsided mean would make a deep tree: the median bounds the depth by log n.
    if (std::min(middle - first, last - middle) < size / 4) {
      middle = first + size / 2;
      std::nth_element(first, middle, last, [&](uint32_t a, uint32_t b) {
        return std::pair(centre(a), a) < std::pair(centre(b), b);
      });
    }
    return static_cast<std::size_t>(middle - items_.begin());
  }
  return begin;
}

}  // namespace offstage::sim
