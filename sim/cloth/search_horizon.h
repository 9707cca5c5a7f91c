#pragma once
/// Chooses for how many sub-steps a search for self-contact pairs is valid. A search for many sub-steps finds
/// many pairs, which all have to be checked, and points leave their predicted paths before its end. A search
/// for few sub-steps has to be repeated soon. Which is cheaper depends on the motion. Therefore the work per
/// second of simulated time is counted, and a shorter or longer horizon is tried from time to time. The
/// counts are numbers of operations, not times: the choice is the same in every run.

#include <array>
#include <cstdint>

#include "sim/core/types.h"

namespace offstage::sim {

class SearchHorizon {
 public:
  /// Adds to the number of operations (of searching or checking pairs) in the current period.
  void add_work(Real work) { work_ += work; }
  /// Ends a period, which lasted for `lasted` [s] of simulated time, and begins the next one with a new
  /// search. Returns the number of sub-steps for which the new search must be valid.
  uint32_t next(Real lasted) {
    if (!(lasted > 0)) return kLengths[tried_];  // searched twice in one sub-step: the period goes on
    const Real rate = work_ / lasted;
    rate_[tried_] = rate_[tried_] > 0 ? (rate_[tried_] + rate) / 2 : rate;
    work_ = 0;
    ++periods_;
    if (tried_ != level_) judge();
    tried_ = periods_ < wait_ ? level_ : neighbour();
    return kLengths[tried_];
  }

 private:
  static constexpr std::array<uint32_t, 7> kLengths = {1, 2, 3, 4, 6, 8, 12};
  /// Number of periods until the next trial of another horizon: kWaitAfterGain after a successful trial,
  /// otherwise kWait.
  static constexpr uint32_t kWait = 8, kWaitAfterGain = 2;
  /// Another horizon is chosen if its work is less than this fraction of the current work.
  static constexpr Real kWorthIt = 0.95;

  uint32_t neighbour() const {
    const bool at_end = up_ ? level_ + 1 == kLengths.size() : level_ == 0;
    return at_end ? level_ : up_ ? level_ + 1 : level_ - 1;
  }
  void judge() {
    const bool gain = rate_[tried_] < kWorthIt * rate_[level_];
    if (gain) level_ = tried_;
    if (!gain || neighbour() == level_) up_ = !up_;
    wait_ = gain ? kWaitAfterGain : kWait;
    periods_ = 0;
  }

  std::array<Real, kLengths.size()> rate_ = {};  // work per second of simulated time; 0: unknown
  Real work_ = 0;
  uint32_t level_ = 4, tried_ = 4, periods_ = 0, wait_ = kWait;
  bool up_ = false;
};

}  // namespace offstage::sim
