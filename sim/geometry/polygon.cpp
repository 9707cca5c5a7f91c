#include "sim/geometry/polygon.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace offstage::sim {
namespace {

using Loop = std::vector<uint32_t>;

/// If the sine of the turn at a vertex is less than this, the polygon counts as straight there.
constexpr Real kFlatPolygon = 1e-6;

Real cross(const Vec2& a, const Vec2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

Real sine(const Vec2& a, const Vec2& b) {
  const Real norms = std::sqrt(a.squaredNorm() * b.squaredNorm());
  return norms > 0 ? cross(a, b) / norms : 0;
}

Real distance_to_segment(const Vec2& p, const Vec2& a, const Vec2& b) {
  const Vec2 d = b - a;
  const Real t = d.squaredNorm() > 0 ? std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0;
  return (p - a - t * d).norm();
}

/// Whether two segments cross at a point interior to both.
bool cross_properly(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d) {
  const Real c_side = cross(b - a, c - a), d_side = cross(b - a, d - a);
  const Real a_side = cross(d - c, a - c), b_side = cross(d - c, b - c);
  return ((c_side > 0) != (d_side > 0)) && ((a_side > 0) != (b_side > 0));
}

/// Part of a polygon that is being cut along diagonals.
class Divider {
 public:
  Divider(std::span<const Vec2> polygon, Real tolerance) : points_(polygon), tolerance_(tolerance) {}

  /// Returns false if a reflex vertex has no diagonal.
  bool divide(Loop loop) {
    std::vector<Loop> rest = {std::move(loop)};
    while (!rest.empty()) {
      const Loop part = std::move(rest.back());
      rest.pop_back();
      const std::size_t reflex = first_reflex(part);
      if (reflex == part.size()) {
        pieces.push_back(part);
        continue;
      }
      const std::size_t other = best_diagonal(part, reflex);
      if (other == part.size()) return false;
      const std::size_t low = std::min(reflex, other), high = std::max(reflex, other);
      const auto at = [&](std::size_t k) { return part.begin() + static_cast<std::ptrdiff_t>(k); };
      rest.emplace_back(at(low), at(high + 1));
      rest.emplace_back(at(high), part.end());
      rest.back().insert(rest.back().end(), part.begin(), at(low + 1));
    }
    return true;
  }

  std::vector<Loop> pieces;

 private:
  const Vec2& point(const Loop& loop, std::size_t k) const { return points_[loop[k % loop.size()]]; }
  Vec2 side_into(const Loop& loop, std::size_t k) const {
    return point(loop, k) - point(loop, k + loop.size() - 1);
  }
  Vec2 side_from(const Loop& loop, std::size_t k) const { return point(loop, k + 1) - point(loop, k); }

  bool is_reflex(const Loop& loop, std::size_t k) const {
    return sine(side_into(loop, k), side_from(loop, k)) < -kFlatPolygon;
  }

  std::size_t first_reflex(const Loop& loop) const {
    std::size_t k = 0;
    while (k < loop.size() && !is_reflex(loop, k)) ++k;
    return k;
  }

  /// Whether a ray from a vertex starts into the polygon.
  bool starts_inside(const Loop& loop, std::size_t k, const Vec2& d) const {
    const bool left_of_next = sine(side_from(loop, k), d) > kFlatPolygon;
    const bool left_of_last = sine(side_into(loop, k), d) > kFlatPolygon;
    return is_reflex(loop, k) ? left_of_next || left_of_last : left_of_next && left_of_last;
  }

  /// Whether a cut along a ray from a vertex leaves no reflex angle on either side of the ray.
  bool straightens(const Loop& loop, std::size_t k, const Vec2& d) const {
    return sine(side_from(loop, k), d) > -kFlatPolygon && sine(side_into(loop, k), d) > -kFlatPolygon;
  }

  bool is_diagonal(const Loop& loop, std::size_t i, std::size_t j) const {
    const Vec2 &a = point(loop, i), &b = point(loop, j);
    if (!starts_inside(loop, i, b - a) || !starts_inside(loop, j, a - b)) return false;
    // Where the outline touches itself, several corners are at an end point; the wedge test has selected the
    // right one.
    const auto is_end = [&](const Vec2& p) {
      return (p - a).norm() <= tolerance_ || (p - b).norm() <= tolerance_;
    };
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const Vec2 &c = point(loop, k), &d = point(loop, k + 1);
      if (is_end(c)) continue;
      if (distance_to_segment(c, a, b) <= tolerance_) return false;
      if (!is_end(d) && cross_properly(a, b, c, d)) return false;
    }
    return true;
  }

  /// Returns the diagonal from a reflex vertex that removes the most reflex angles. Among equally good
  /// diagonals it is the shortest.
  std::size_t best_diagonal(const Loop& loop, std::size_t from) const {
    std::size_t best = loop.size();
    std::tuple<int, Real> best_cost{0, std::numeric_limits<Real>::infinity()};
    for (std::size_t to = 0; to < loop.size(); ++to) {
      if (to == from || !is_diagonal(loop, from, to)) continue;
      const Vec2 d = point(loop, to) - point(loop, from);
      const int removed =
          int(straightens(loop, from, d)) + int(is_reflex(loop, to) && straightens(loop, to, -d));
      const std::tuple<int, Real> cost{-removed, d.squaredNorm()};
      if (cost < best_cost) {
        best_cost = cost;
        best = to;
      }
    }
    return best;
  }

  std::span<const Vec2> points_;
  Real tolerance_;
};

}  // namespace

bool well_inside(std::span<const Vec2> polygon, const Vec2& p, Real margin) {
  bool inside = false;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec2 &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
    if (distance_to_segment(p, a, b) <= margin) return false;
    if ((a.y() > p.y()) != (b.y() > p.y()) && (cross(b - a, p - a) > 0) == (b.y() > a.y())) inside = !inside;
  }
  return inside;
}

std::vector<std::vector<uint32_t>> convex_pieces(std::span<const Vec2> polygon, Real tolerance) {
  Loop all(polygon.size());
  for (uint32_t k = 0; k < all.size(); ++k) all[k] = k;
  Divider divider(polygon, tolerance);
  if (!divider.divide(std::move(all))) return {};
  return std::move(divider.pieces);
}

}  // namespace offstage::sim
