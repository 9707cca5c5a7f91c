#pragma once
/// Overlap tests and lower bounds of distance for two volumes of bounding trees, each in the frame of its own
/// mesh. Both are conservative: rounding never separates volumes that have a common point.

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "sim/collision/bounding_volume.h"
#include "sim/linear/lanes.h"

namespace offstage::sim {

inline Vec3 centre(const Aabb& v) {
  return (v.min() + v.max()) / 2;
}
inline Vec3 centre(const Obb& v) {
  return v.centre;
}
inline Vec3 centre(const BoundingSphere& v) {
  return v.centre;
}
inline Vec3 half_sizes(const Aabb& v) {
  return (v.max() - v.min()) / 2;
}
inline Vec3 half_sizes(const Obb& v) {
  return v.half;
}

/// Square of the volume's diameter [m^2].
inline Real squared_size(const Aabb& v) {
  return (v.max() - v.min()).squaredNorm();
}
inline Real squared_size(const Obb& v) {
  return 4 * v.half.squaredNorm();
}
inline Real squared_size(const BoundingSphere& v) {
  return 4 * v.radius * v.radius;
}

/// Frame B placed in frame A, prepared for testing many volumes.
struct Placement {
  /// `size` bounds the distance of every tested point from the origin of its frame [m]; the allowance for
  /// rounding is proportional to it. Volumes count as overlapping if their distance is at most `margin` [m].
  Placement(const Pose& a_from_b, Real size, Real margin)
      : rotation(a_from_b.orientation.normalized().toRotationMatrix()),
        translation(a_from_b.position),
        slack(kRounding * (2 * size + translation.norm())),
        pad(margin + slack) {}

  /// A point of B in A's frame.
  Vec3 point(const Vec3& p) const { return rotation * p + translation; }

  /// Rounding errors: a volume's corner comes from a fitted box (3 products and sums), the placement (4) and
  /// a projection (6), each with an error of half a unit in the last place of the sizes involved; axes are
  /// orthonormal to a few units.
  static constexpr Real kRounding = 64 * std::numeric_limits<Real>::epsilon();

  Mat3 rotation;  ///< rotation matrix from B's axes to A's axes
  Vec3 translation;
  Real slack;  ///< bound of the rounding errors [m]
  Real pad;    ///< margin and slack [m]
};

/// Two boxes, the second one in the axes of the first. A gap is the distance along a direction, negative
/// where they overlap.
struct BoxPair {
  /// Rotation matrix from b's axes to a's axes, and the absolute values of its elements.
  LaneColumns rotation, spread;
  Lanes offset;  ///< difference of the centres
  Vec3 half_a, half_b;

  Lanes gaps_a() const { return lane_abs(offset) - lanes(half_a) - product(spread, half_b); }
  Lanes gaps_b() const {
    return lane_abs(product(transposed(rotation), offset)) - lanes(half_b) -
           product(transposed(spread), half_a);
  }
  /// Gaps along the products of each of a's edges with each of b's. The products are not unit vectors, so the
  /// gaps are too small but have the right sign. For parallel edges they are rounding noise around 0.
  Lanes product_gaps() const {
    const auto [x, y, z] = spread;
    return lane_max(lane_max(product_gaps(rotation.x, x, half_b[1] * z + half_b[2] * y),
                             product_gaps(rotation.y, y, half_b[2] * x + half_b[0] * z)),
                    product_gaps(rotation.z, z, half_b[0] * y + half_b[1] * x));
  }

 private:
  /// Gaps along the cross products of one edge direction of b, with the columns r and |r| = s in a's axes,
  /// and all edges of a. `extent_b`: half extent of b along these products.
  Lanes product_gaps(Lanes r, Lanes s, Lanes extent_b) const {
    const Lanes a = lanes(half_a);
    return lane_abs(lane_last(offset) * lane_next(r) - lane_next(offset) * lane_last(r)) -
           (lane_next(a) * lane_last(s) + lane_last(a) * lane_next(s)) - extent_b;
  }
};

inline LaneColumns to_axes(const Aabb&, const Mat3& m) {
  return columns(m);
}
inline LaneColumns to_axes(const Obb& box, const Mat3& m) {
  return product(columns(box.axes.transpose()), m);
}
inline Lanes to_axes(const Aabb&, const Vec3& v) {
  return lanes(v);
}
inline Lanes to_axes(const Obb& box, const Vec3& v) {
  return product(columns(box.axes.transpose()), v);
}
inline LaneColumns from_axes(const LaneColumns& m, const Aabb&) {
  return m;
}
inline LaneColumns from_axes(const LaneColumns& m, const Obb& box) {
  return product(m, box.axes);
}

/// Always inline, because a call would return the vectors through memory.
template <class A, class B>
[[gnu::always_inline]] inline BoxPair box_pair(const A& a, const B& b, const Placement& p) {
  const LaneColumns placed = to_axes(a, p.rotation);
  const LaneColumns rotation = from_axes(placed, b);
  const Lanes offset = to_axes(a, Vec3(p.translation - centre(a))) + product(placed, centre(b));
  return {rotation, lane_abs(rotation), offset, half_sizes(a), half_sizes(b)};
}

/// Distance of a point from a box along the box's axes; negative inside.
inline Vec3 point_gaps(const Aabb& box, const Vec3& p) {
  return (p - centre(box)).cwiseAbs() - half_sizes(box);
}
inline Vec3 point_gaps(const Obb& box, const Vec3& p) {
  return (box.axes.transpose() * (p - box.centre)).cwiseAbs() - box.half;
}

template <class Volume>
inline constexpr bool kIsSphere = std::is_same_v<Volume, BoundingSphere>;

/// Returns a lower bound of the distance of two volumes [m], 0 or less if they may overlap. It is exact if
/// one volume is a sphere; for two boxes only the axes of both boxes are used. Because of rounding it may
/// exceed the true distance by Placement::slack.
template <class A, class B>
Real gap(const A& a, const B& b, const Placement& p) {
  if constexpr (kIsSphere<A> && kIsSphere<B>) {
    return (p.point(b.centre) - a.centre).norm() - a.radius - b.radius;
  } else if constexpr (kIsSphere<B>) {
    return point_gaps(a, p.point(b.centre)).cwiseMax(0).norm() - b.radius;
  } else if constexpr (kIsSphere<A>) {
    const Vec3 in_b = p.rotation.transpose() * (a.centre - p.translation);
    return point_gaps(b, in_b).cwiseMax(0).norm() - a.radius;
  } else {
    const BoxPair pair = box_pair(a, b, p);
    const Lanes zero = {}, gaps_a = lane_max(pair.gaps_a(), zero), gaps_b = lane_max(pair.gaps_b(), zero);
    const Lanes a2 = gaps_a * gaps_a, b2 = gaps_b * gaps_b;
    return std::sqrt(std::max(a2[0] + a2[1] + a2[2], b2[0] + b2[1] + b2[2]));
  }
}

/// Whether two volumes may have points within the margin of each other. Without a margin it is exact up to
/// the slack; two boxes are tested by their fifteen axes. All gaps are computed before any is tested, because
/// most pairs in a traversal overlap.
template <class A, class B>
bool overlap(const A& a, const B& b, const Placement& p) {
  if constexpr (kIsSphere<A> || kIsSphere<B>) {
    return gap(a, b, p) <= p.pad;
  } else {
    const BoxPair pair = box_pair(a, b, p);
    const Lanes most = lane_max(lane_max(pair.gaps_a(), pair.gaps_b()), pair.product_gaps());
    return most[0] <= p.pad && most[1] <= p.pad && most[2] <= p.pad;
  }
}

}  // namespace offstage::sim
