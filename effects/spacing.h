#pragma once
/// Private: checks that balls do not overlap, by a hash table of grid cells.

#include <cstdint>
#include <vector>

#include "effects/random.h"

namespace offstage::effects {

class Spacing {
 public:
  /// Clears the table, for about `count` balls (with more, it is slower) of at most `diameter` [m].
  void reset(uint64_t count, Real diameter);
  /// Adds the ball unless it overlaps a ball in the table; returns whether it was added.
  bool add(const Vec3& centre, Real radius);
  /// Adds the ball, even if it overlaps others.
  void insert(const Vec3& centre, Real radius);

 private:
  struct Ball {
    Vec3 centre;
    Real radius;
    uint32_t next;  // next ball in its bucket
  };

  Eigen::Matrix<int64_t, 3, 1> cell_at(const Vec3& point) const;
  uint32_t& bucket(const Eigen::Matrix<int64_t, 3, 1>& cell);
  bool is_clear(const Eigen::Matrix<int64_t, 3, 1>& cell, const Vec3& centre, Real radius);

  Real edge_ = 1;
  std::vector<uint32_t> buckets_;
  std::vector<Ball> balls_;
};

}  // namespace offstage::effects
