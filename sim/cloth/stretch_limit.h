#pragma once
/// The greatest length of springs (physics F7): a few sweeps first shorten springs that are too long, which
/// preserves the motion of the cloth; then moves are shortened until every limit holds, which guarantees it.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/cloth/cloth_points.h"

namespace offstage::sim {

/// Share of its move of a sub-step that each point makes.
using MoveShares = std::vector<Real>;

class StretchLimit {
 public:
  struct Limit {
    uint32_t a, b;
    Real rest, longest;  // [m]
  };

  /// Sets the limits and the ties, such as seams. Ties are shortened together with the limits, but no move is
  /// shortened because a tie is too long. Both ends of a tie make the same share of their moves, so that no
  /// tie opens.
  void assign(std::vector<Limit> limits, std::vector<Limit> ties, std::size_t point_count);
  bool empty() const { return limits_.empty(); }
  /// Length of a tie at the start of the sub-step, and its allowed length from now on [m].
  Real tie_length(std::size_t tie, const ClothPoints& points) const {
    return (points.start[ties_[tie].a] - points.start[ties_[tie].b]).norm();
  }
  void set_tie(std::size_t tie, Real length) { ties_[tie].rest = ties_[tie].longest = length; }

  /// Shortens springs that are too long. Returns whether there were any. Some may stay too long.
  bool project(ClothPoints& points) const;

  /// Lowers shares of moves where a limit does not hold, and returns whether it did. This ends, because with
  /// shares of 0 the lengths are those at the start, where the limits held. Pinned points always make their
  /// whole move. On entry `lowered` holds the points whose shares were lowered since their last check, and
  /// only their limits are checked; while all shares are 1, all limits are. On return it holds the points
  /// that this call lowered.
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
