#pragma once
/// The greatest length of springs (physics F7): first what is too long is drawn together in a few sweeps,
/// which keeps the cloth lively; then moves are shortened until every limit holds, which makes it sure.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/cloth/cloth_points.h"

namespace offstage::sim {

/// Which share of its move of a sub-step each point makes.
using MoveShares = std::vector<Real>;

class StretchLimit {
 public:
  struct Limit {
    uint32_t a, b;
    Real rest, longest;  // [m]
  };

  void assign(std::vector<Limit> limits) { limits_ = std::move(limits); }
  bool empty() const { return limits_.empty(); }

  /// Draws together what is too long; whether anything was. It may not suffice.
  bool project(ClothPoints& points) const;

  /// Lowers shares of moves where a limit does not hold; whether it did. If both ends made none, the lengths
  /// would be those at the start, which held. What pins hold always makes its whole move.
  bool shorten(const ClothPoints& points, MoveShares& shares) const;

 private:
  std::vector<Limit> limits_;
};

}  // namespace offstage::sim
