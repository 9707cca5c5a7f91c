#include "sim/collision/tree_split.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <utility>

#include <tbb/parallel_invoke.h>

namespace offstage::sim {
namespace {

/// With fewer items, a separate task costs more than it saves.
constexpr uint32_t kTaskItems = 4096;

Aabb midpoint_box(std::span<const TreeItem> items) {
  Aabb box;
  for (const TreeItem& item : items) box.extend(item.midpoint);
  return box;
}

std::size_t median_split(std::span<TreeItem> items, int axis) {
  const std::size_t half = items.size() / 2;
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(half), items.end(),
                   [axis](const TreeItem& a, const TreeItem& b) {
                     return std::pair(a.midpoint[axis], a.index) < std::pair(b.midpoint[axis], b.index);
                   });
  return half;
}

template <class IsFirst>
std::size_t partition(std::span<TreeItem> items, IsFirst&& is_first) {
  return static_cast<std::size_t>(std::partition(items.begin(), items.end(), is_first) - items.begin());
}

std::size_t mean_split(std::span<TreeItem> items, int axis) {
  Real sum = 0;
  for (const TreeItem& item : items) sum += item.midpoint[axis];
  const Real mean = sum / static_cast<Real>(items.size());
  const std::size_t split = partition(items, [&](const TreeItem& t) { return t.midpoint[axis] < mean; });
  const bool balanced = std::min(split, items.size() - split) >= items.size() / 4;
  return balanced && split > 0 ? split : median_split(items, axis);
}

/// Distributes the midpoints of a node's items among slices of equal width along each axis.
class Bins {
 public:
  static constexpr int kCount = 16;

  explicit Bins(const Aabb& midpoints) : low_(midpoints.min()) {
    const Vec3 extent = midpoints.sizes();
    // If the extent is almost zero, all items are in the first slice.
    for (int k = 0; k < 3; ++k) scale_[k] = extent[k] > 1e-300 ? kCount / extent[k] : 0;
  }

  int bin_of(const TreeItem& item, int axis) const {
    return std::min(static_cast<int>((item.midpoint[axis] - low_[axis]) * scale_[axis]), kCount - 1);
  }

  void add(const TreeItem& item) {
    for (int axis = 0; axis < 3; ++axis) {
      Bin& bin = bins_[static_cast<std::size_t>(axis * kCount + bin_of(item, axis))];
      bin.box.extend(item.box);
      ++bin.count;
    }
  }

  /// Returns the split with the least cost by the surface area heuristic: its axis, and the first bin of the
  /// second half. The bin is 0 if no axis separates the items.
  std::pair<int, int> best_split() const {
    std::pair<int, int> best = {0, 0};
    Real least = kInfinity;
    for (int axis = 0; axis < 3; ++axis) {
      std::array<Real, kCount> first_cost;
      sweep(axis, 0, 1, [&](int bin, Real cost) { first_cost[static_cast<std::size_t>(bin)] = cost; });
      sweep(axis, kCount - 1, -1, [&](int bin, Real cost) {
        if (bin == 0) return;
        const Real total = cost + first_cost[static_cast<std::size_t>(bin - 1)];
        if (total >= least) return;
        least = total;
        best = {axis, bin};
      });
    }
    return best;
  }

 private:
  struct Bin {
    Aabb box;
    uint32_t count = 0;
  };

  /// Calls visit(bin, cost of the bins from the first to this one); the cost is infinite while they are
  /// empty.
  template <class Visit>
  void sweep(int axis, int from, int step, Visit&& visit) const {
    Bin sum;
    for (int i = 0; i < kCount; ++i) {
      const int bin = from + i * step;
      const Bin& b = bins_[static_cast<std::size_t>(axis * kCount + bin)];
      sum.count += b.count;
      sum.box.extend(b.box);
      visit(bin, sum.count > 0 ? half_area(sum.box) * sum.count : kInfinity);
    }
  }

  static Real half_area(const Aabb& box) {
    const Vec3 s = box.sizes();
    return s.x() * s.y() + s.y() * s.z() + s.z() * s.x();
  }

  Vec3 low_, scale_;
  std::array<Bin, 3 * kCount> bins_;
};

std::size_t surface_area_split(std::span<TreeItem> items, const Aabb& midpoints) {
  Bins bins(midpoints);
  for (const TreeItem& item : items) bins.add(item);
  const auto best = bins.best_split();
  return partition(items, [&, axis = best.first, bin = best.second](const TreeItem& item) {
    return bins.bin_of(item, axis) < bin;
  });
}

/// Splits the items. Returns the start of the second half, or 0 if the items cannot be separated.
std::size_t split_items(std::span<TreeItem> items, TreeSplit split, uint32_t depth) {
  if (items.size() < 2) return 0;
  const Aabb midpoints = midpoint_box(items);
  int axis = 0;
  if (!(midpoints.sizes().maxCoeff(&axis) > 0)) return 0;
  // From this depth on, only halving reaches single items within the limit.
  const bool too_deep = depth + std::bit_width(items.size()) >= kMaxTreeDepth;
  if (items.size() == 2 || too_deep) return median_split(items, axis);
  return split == TreeSplit::mean ? mean_split(items, axis) : surface_area_split(items, midpoints);
}

struct Splitter {
  std::span<TreeItem> items;
  TreeSplit split;

  /// Appends the subtree of a range of the items.
  void run(uint32_t first, uint32_t count, uint32_t depth, std::vector<TreeRange>& nodes) const {
    const std::size_t self = nodes.size();
    nodes.push_back({1, first, count});
    const auto part = static_cast<uint32_t>(split_items(items.subspan(first, count), split, depth));
    if (part == 0) return;
    if (count > kTaskItems) {
      std::vector<TreeRange> second;
      tbb::parallel_invoke([&] { run(first, part, depth + 1, nodes); },
                           [&] { run(first + part, count - part, depth + 1, second); });
      nodes.insert(nodes.end(), second.begin(), second.end());
    } else {
      run(first, part, depth + 1, nodes);
      run(first + part, count - part, depth + 1, nodes);
    }
    nodes[self].size = static_cast<uint32_t>(nodes.size() - self);
  }
};

}  // namespace

std::vector<TreeRange> split_tree(std::span<TreeItem> items, TreeSplit split) {
  std::vector<TreeRange> nodes;
  if (items.empty()) return nodes;
  nodes.reserve(2 * items.size());
  Splitter{items, split}.run(0, static_cast<uint32_t>(items.size()), 0, nodes);
  return nodes;
}

}  // namespace offstage::sim
