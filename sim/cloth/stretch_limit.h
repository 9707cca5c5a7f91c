#pragma once
/// The greatest length of springs (physics F7). First, a few sweeps shorten springs that are too long. Where
/// that is not enough, as under a body that hangs on the cloth, the impulses of all springs at their limit
/// are solved for together. Both preserve the momentum. Finally, moves are shortened until every limit holds.
/// This last step always succeeds.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/cloth/cloth_bodies.h"
#include "sim/cloth/cloth_points.h"
#include "sim/cloth/taut_springs.h"

namespace offstage::sim {

/// Fraction of its displacement in a sub-step that each point makes.
using MoveFractions = std::vector<Real>;

class StretchLimit {
 public:
  using Limit = SpringLimit;

  /// Sets the length limits and the ties, for example seams. project() also shortens ties that are too long,
  /// but shorten() does not check them. It gives both ends of a tie the same fraction, so that no tie opens.
  void assign(std::vector<Limit> limits, std::vector<Limit> ties, std::size_t point_count);
  bool empty() const { return limits_.empty(); }
  /// Length of a tie at the start of the sub-step, and its allowed length from now on [m].
  Real tie_length(std::size_t tie, const ClothPoints& points) const {
    return (points.start[ties_[tie].a] - points.start[ties_[tie].b]).norm();
  }
  void set_tie(std::size_t tie, Real length) { ties_[tie].rest = ties_[tie].longest = length; }

  /// Shortens springs that are too long in a sub-step of length dt [s], and moves the bodies pinned to them.
  /// Returns whether there were any such springs. Some springs may still be too long afterwards. `kick` and
  /// `cuts`: see TautSprings::apply().
  bool project(ClothPoints& points, std::span<const Carrier> carriers, Real dt, std::span<const Vec4> kick,
               std::vector<VelocityCut>& cuts);
  /// Whether any spring is too long, not counting those that tear first.
  bool any_too_long(const ClothPoints& points) const;
  /// Whether any spring is too long, including those that tear.
  bool any_beyond(const ClothPoints& points) const;
  /// Solves for all springs at their limits and these contacts together.
  void project_with(std::span<const BodyContact> contacts, ClothPoints& points,
                    std::span<const Carrier> carriers, Real dt, std::span<const Vec4> kick,
                    std::vector<VelocityCut>& cuts) const;

  /// Lowers fractions of moves where a limit does not hold, and returns whether it did. Repeated calls come
  /// to an end, because with fractions of 0 the lengths are those at the start, where the limits held. All
  /// points pinned to one dynamic body get the same fraction; other pinned points keep the fraction 1. On
  /// entry `lowered` holds the points whose fractions were lowered since their last check, and only their
  /// limits are checked; while all fractions are 1, all limits are. On return it holds the points that this
  /// call lowered.
  bool shorten(const ClothPoints& points, std::span<const Carrier> carriers, MoveFractions& fractions,
               std::vector<uint32_t>& lowered);
  bool shorten_whole_moves(const ClothPoints& points, std::span<const Carrier> carriers,
                           MoveFractions& fractions, std::vector<uint32_t>& lowered) const;

 private:
  void look(const Limit& limit, const ClothPoints& points, MoveFractions& fractions,
            std::vector<uint32_t>& lowered) const;

  void even_ties(const ClothPoints& points, MoveFractions& fractions, std::vector<uint32_t>& lowered) const;
  static void even_carriers(std::span<const Carrier> carriers, MoveFractions& fractions,
                            std::vector<uint32_t>& lowered);
  bool sweep(ClothPoints& points, bool& all_hold) const;

  std::vector<Limit> limits_, ties_;
  // Limits of all points, one point after the other; and by point, the index of its first limit.
  std::vector<uint32_t> limits_at_, first_at_;
  std::vector<uint32_t> looked_in_;  // round in which each limit was last checked
  uint32_t round_ = 0;
};

}  // namespace offstage::sim
