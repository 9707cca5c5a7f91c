#pragma once
/// Axis-aligned boxes that move linearly from a start to an end, in single precision and rounded outwards.

#include <array>
#include <cstdint>
#include <limits>

#include <immintrin.h>

#include "sim/cloth/cloth_points.h"

namespace offstage::sim {

struct MovingBox {
  using Corner = Eigen::Array4f;    // x y z 0
  std::array<Corner, 2> low, high;  ///< corners at the start and at the end of the motion

  /// Returns the box that has these bounds at the start and at the end of the motion.
  static MovingBox around(const Vec4& low_start, const Vec4& high_start, const Vec4& low_end,
                          const Vec4& high_end) {
    return {{below(low_start), below(low_end)}, {above(high_start), above(high_end)}};
  }
  void extend(const MovingBox& b) {
    for (std::size_t end : {0u, 1u}) {
      low[end] = low[end].min(b.low[end]);
      high[end] = high[end].max(b.high[end]);
    }
  }
  /// Whether the boxes may overlap. False if they are separated along one axis during the whole motion.
  bool may_overlap(const MovingBox& b) const {
    const Corner over = (low[0] - b.high[0]).min(low[1] - b.high[1]);
    const Corner under = (b.low[0] - high[0]).min(b.low[1] - high[1]);
    return over.max(under).maxCoeff() <= 0;
  }

 private:
  static constexpr float kRounding = 2 * std::numeric_limits<float>::epsilon();
  static Corner below(const Vec4& p) {
    const Corner x = p.array().cast<float>();
    return x - kRounding * x.abs();
  }
  static Corner above(const Vec4& p) {
    const Corner x = p.array().cast<float>();
    return x + kRounding * x.abs();
  }
};

/// Eight moving boxes, one in each lane of a register.
class EightBoxes {
 public:
  static constexpr uint32_t kCount = 8;

  /// Makes all boxes empty.
  void clear() {
    constexpr float kFar = std::numeric_limits<float>::max();
    for (auto& end : low_) end.fill(_mm256_set1_ps(kFar));
    for (auto& end : high_) end.fill(_mm256_set1_ps(-kFar));
  }
  void set(uint32_t lane, const MovingBox& box) {
    for (std::size_t end : {0u, 1u})
      for (std::size_t axis : {0u, 1u, 2u}) {
        low_[end][axis][lane] = box.low[end][static_cast<Eigen::Index>(axis)];
        high_[end][axis][lane] = box.high[end][static_cast<Eigen::Index>(axis)];
      }
  }
  /// Bit mask of the boxes that `box` may overlap.
  uint32_t overlapping(const MovingBox& box) const {
    __m256 apart = gap(box, 0);
    for (std::size_t axis : {1u, 2u}) apart = _mm256_max_ps(apart, gap(box, axis));
    return static_cast<uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(apart, _mm256_setzero_ps(), _CMP_LE_OQ)));
  }

 private:
  typedef float Eight __attribute__((vector_size(8 * sizeof(float))));

  __m256 gap(const MovingBox& box, std::size_t axis) const {
    const auto of = [&](const MovingBox::Corner& c) {
      return _mm256_set1_ps(c[static_cast<Eigen::Index>(axis)]);
    };
    const __m256 over = _mm256_min_ps(of(box.low[0]) - high_[0][axis], of(box.low[1]) - high_[1][axis]);
    const __m256 under = _mm256_min_ps(low_[0][axis] - of(box.high[0]), low_[1][axis] - of(box.high[1]));
    return _mm256_max_ps(over, under);
  }

  std::array<std::array<Eight, 3>, 2> low_, high_;  // by end and axis
};

}  // namespace offstage::sim
