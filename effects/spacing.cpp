#include "effects/spacing.h"

#include <algorithm>
#include <bit>

namespace offstage::effects {
namespace {

constexpr uint32_t kNone = 0xffffffff;
/// Upper limit of the table's size. If it is reached, searches are slower but still correct.
constexpr uint64_t kMaxBuckets = uint64_t{1} << 24;

using Cell = Eigen::Matrix<int64_t, 3, 1>;

}  // namespace

void Spacing::reset(uint64_t count, Real diameter) {
  edge_ = diameter;
  buckets_.assign(std::bit_ceil(std::min(count + 1, kMaxBuckets)), kNone);
  balls_.clear();
}

Cell Spacing::cell_at(const Vec3& point) const {
  return (point / edge_).array().floor().cast<int64_t>();
}

uint32_t& Spacing::bucket(const Cell& cell) {
  const auto key = [&](int axis) { return static_cast<uint64_t>(cell[axis]); };
  return buckets_[combined(combined(key(0), key(1)), key(2)) & (buckets_.size() - 1)];
}

/// The bucket may also contain balls of other cells; these do not change the result.
bool Spacing::is_clear(const Cell& cell, const Vec3& centre, Real radius) {
  for (uint32_t i = bucket(cell); i != kNone; i = balls_[i].next) {
    const Real reach = radius + balls_[i].radius;
    if ((balls_[i].centre - centre).squaredNorm() < reach * reach) return false;
  }
  return true;
}

bool Spacing::add(const Vec3& centre, Real radius) {
  const Cell middle = cell_at(centre);
  for (int64_t x = -1; x <= 1; ++x)
    for (int64_t y = -1; y <= 1; ++y)
      for (int64_t z = -1; z <= 1; ++z)
        if (!is_clear(middle + Cell(x, y, z), centre, radius)) return false;
  insert(centre, radius);
  return true;
}

void Spacing::insert(const Vec3& centre, Real radius) {
  uint32_t& head = bucket(cell_at(centre));
  balls_.push_back({centre, radius, head});
  head = static_cast<uint32_t>(balls_.size() - 1);
}

}  // namespace offstage::effects
