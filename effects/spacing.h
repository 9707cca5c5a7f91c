#pragma once
/// Private: finds out whether a ball keeps clear of others, by a hash table of grid cells.

#include <cstdint>
#include <vector>

#include "effects/random.h"

namespace offstage::effects {

class Spacing {
 public:
  /// Starts again, for up to `count` balls none of which is larger than `diameter` [m].
  void reset(uint64_t count, Real diameter);
  /// Takes the ball in unless it overlaps one that is in.
  bool add(const Vec3& centre, Real radius);

 private:
  struct Ball {
    Vec3 centre;
    Real radius;
    uint32_t next;  // in its bucket
  };

  uint32_t& bucket(const Eigen::Matrix<int64_t, 3, 1>& cell);
  bool is_clear(const Eigen::Matrix<int64_t, 3, 1>& cell, const Vec3& centre, Real radius);

  Real edge_ = 1;
  std::vector<uint32_t> buckets_;
  std::vector<Ball> balls_;
};

}  // namespace offstage::effects
