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

  /// Ties, as seams are, are drawn together with the limits, but no move is shortened because one is too
  /// long: its ends make the same share of their moves, so that none opens.
  void assign(std::vector<Limit> limits, std::vector<Limit> ties, std::size_t point_count);
  bool empty() const { return limits_.empty(); }
  /// What a tie measured at the start of the sub-step, and the length that it may have from now on [m].
  Real tie_length(std::size_t tie, const ClothPoints& points) const {
    return (points.start[ties_[tie].a] - points.start[ties_[tie].b]).norm();
  }
  void set_tie(std::size_t tie, Real length) { ties_[tie].rest = ties_[tie].longest = length; }

  /// Draws together what is too long; whether anything was. It may not suffice.
  bool project(ClothPoints& points) const;

  /// Lowers shares of moves where a limit does not hold; whether it did. If both ends made none, the lengths
  /// would be those at the start, which held. What pins hold always makes its whole move. Looks at the limits
  /// of the points in `lowered`, whose shares were lowered since they were looked at last, and leaves there
  /// those that it lowered itself. While all shares are 1, at all limits.
  bool shorten(const ClothPoints& points, MoveShares& shares, std::vector<uint32_t>& lowered);
  bool shorten_whole_moves(const ClothPoints& points, MoveShares& shares,
                           std::vector<uint32_t>& lowered) const;

 private:
  void look(const Limit& limit, const ClothPoints& points, MoveShares& shares,
            std::vector<uint32_t>& lowered) const;

  void even_ties(const ClothPoints& points, MoveShares& shares, std::vector<uint32_t>& lowered) const;

  std::vector<Limit> limits_, ties_;
  std::vector<uint32_t> limits_at_,
      first_at_;                     // of each point, one point's after another's; where they begin
  std::vector<uint32_t> looked_in_;  // the round in which each limit was looked at last
  uint32_t round_ = 0;
};

}  // namespace offstage::sim
