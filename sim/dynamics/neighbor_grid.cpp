#include "sim/dynamics/neighbor_grid.h"

#include <bit>

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_reduce.h>

namespace offstage::sim {
namespace {

constexpr std::size_t kGridChunk = 4096;
/// Number of leading bits of a cell's index by which points are first distributed into parts. Each part is
/// then sorted separately.
constexpr uint32_t kPartBits = 8;
/// Base-2 logarithm of the least number of cells along an axis. With fewer cells a search would visit the
/// same neighbour twice.
constexpr uint32_t kMinBits = 2;

Aabb bounding_box(std::span<const Vec3> points) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, points.size(), kGridChunk), Aabb(),
      [&](const auto& range, Aabb box) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) box.extend(points[i]);
        return box;
      },
      [](const Aabb& a, const Aabb& b) { return a.merged(b); });
}

}  // namespace

/// Chooses the number of cells along each axis. There are about as many cells as the box of the points
/// contains, but not many more than points. If the number must be reduced, the longer axes wrap around first.
void NeighborGrid::choose_torus(std::span<const Vec3> points) {
  const Aabb box = bounding_box(points);
  std::array<Real, 3> extent;
  for (int k = 0; k < 3; ++k)
    extent[static_cast<std::size_t>(k)] =
        points.empty() ? 1 : static_cast<Real>(coordinate(box.max()[k]) - coordinate(box.min()[k]) + 1);
  axis_ = {0, 1, 2};
  std::stable_sort(axis_.begin(), axis_.end(), [&](Eigen::Index a, Eigen::Index b) {
    return extent[static_cast<std::size_t>(a)] > extent[static_cast<std::size_t>(b)];
  });
  for (std::size_t k = 0; k < 3; ++k)
    bits_[k] = std::max(
        kMinBits, static_cast<uint32_t>(std::ceil(std::log2(extent[static_cast<std::size_t>(axis_[k])]))));
  const uint32_t budget = std::max(3 * kMinBits, static_cast<uint32_t>(std::bit_width(points.size()) + 1));
  while (bits_[0] + bits_[1] + bits_[2] > budget) --*std::max_element(bits_.begin(), bits_.end());
  for (std::size_t k = 0; k < 3; ++k) mask_[k] = (1u << bits_[k]) - 1;
}

void NeighborGrid::build(std::span<const Vec3> points, Real cell) {
  const std::size_t n = points.size();
  cell_ = cell;
  inverse_ = 1 / cell;
  index_.resize(n);
  for (std::vector<Real>* of_axis : {&x_, &y_, &z_}) of_axis->resize(n + kLanes);
  choose_torus(points);
  const uint32_t all_bits = bits_[0] + bits_[1] + bits_[2];
  if (n == 0) return begin_.assign((std::size_t{1} << all_bits) + 1, 0);
  const uint32_t shift = all_bits > kPartBits ? all_bits - kPartBits : 0, parts = 1u << (all_bits - shift);
  const std::size_t chunks = (n + kGridChunk - 1) / kGridChunk;
  const auto for_chunks = [&](auto&& f) {
    tbb::parallel_for(std::size_t{0}, chunks,
                      [&](std::size_t c) { f(c, c * kGridChunk, std::min(n, (c + 1) * kGridChunk)); });
  };

  bucket_.resize(n);
  counts_.assign(parts * chunks + 1, 0);
  for_chunks([&](std::size_t c, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      ++counts_[(bucket_[i] = bucket(points[i]), bucket_[i] >> shift) * chunks + c];
  });
  uint32_t sum = 0;
  for (uint32_t& count : counts_) sum += std::exchange(count, sum);
  place_ = counts_;
  parted_.resize(n);
  for_chunks([&](std::size_t c, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      parted_[place_[(bucket_[i] >> shift) * chunks + c]++] = {bucket_[i], static_cast<uint32_t>(i)};
  });

  begin_.assign((std::size_t{1} << all_bits) + 1, 0);
  begin_.back() = static_cast<uint32_t>(n);
  tbb::parallel_for(std::size_t{0}, std::size_t{parts}, [&](std::size_t part) {
    const uint32_t first = counts_[part * chunks], last = counts_[(part + 1) * chunks];
    uint32_t* const begin = &begin_[part << shift];
    const std::size_t cells = std::size_t{1} << shift, base = part << shift;
    for (uint32_t e = first; e < last; ++e) ++begin[parted_[e].first - base];
    uint32_t place = first;
    for (std::size_t b = 0; b < cells; ++b) place += std::exchange(begin[b], place);
    for (uint32_t e = first; e < last; ++e) {
      const auto [bucket, index] = parted_[e];
      const uint32_t at = begin[bucket - base]++;
      x_[at] = points[index].x();
      y_[at] = points[index].y();
      z_[at] = points[index].z();
      index_[at] = index;
    }
    for (std::size_t b = cells - 1; b > 0; --b) begin[b] = begin[b - 1];
    begin[0] = first;
  });
}

}  // namespace offstage::sim
