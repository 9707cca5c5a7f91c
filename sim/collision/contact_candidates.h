#pragma once
/// Contact points before they become a manifold: their names, and the choice of four among many.

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "sim/collision/manifold.h"
#include "sim/collision/supporting_feature.h"

namespace offstage::sim {

/// Shares of the margin, which says how close counts as touching. By kTilt the gap along a face's normal may
/// be shorter than the separation, and parallel edges may pass each other; by kRim a point may lie outside a
/// face, and the true deepest point of a rim be deeper than the polygon's that stands for it.
inline constexpr Real kTilt = 0.05, kRim = 0.001;
/// Of the solids' size: what separations are found to.
inline constexpr Real kSeparationRounding = 1e-9;
/// Sine: a face further from across the separation's normal never gives the normal.
inline constexpr Real kMaxTilt = 0.05;
/// Cosine: a face more inclined to the separation's normal is not near to anything.
inline constexpr Real kNearFace = 0.9;
/// Sine: what is less inclined is parallel.
inline constexpr Real kParallel = 1e-6;

/// Sine: of two faces so nearly alike inclined the larger solid's gives the normal, or A's of solids of one
/// size, lest the points change their names while the solids rock.
inline constexpr Real kAlike = 1e-3;
/// By the tilts and the sizes of both.
inline bool a_gives_normal(Real tilt_a, Real tilt_b, Real reach_a, Real reach_b) {
  return reach_a >= reach_b ? tilt_a <= tilt_b + kAlike : tilt_a + kAlike < tilt_b;
}

// Names of features. A body's name is 0 for A and 1 for B; tags are SupportingFeature's.

inline uint32_t mixed(uint32_t x, uint32_t y) {
  const uint64_t h = ((uint64_t{x} << 32 | y) + 0x9e3779b97f4a7c15u) * 0xbf58476d1ce4e5b9u;
  return static_cast<uint32_t>((h ^ (h >> 32)) * 0x94d049bb133111ebu >> 32);
}
inline uint32_t vertex_id(uint32_t body, uint32_t tag) {
  return mixed(body, tag);
}
inline uint32_t edge_id(uint32_t tag, uint32_t other_tag) {
  return mixed(std::min(tag, other_tag) + 2, std::max(tag, other_tag));
}
/// Of an edge of one body and an edge of the other.
inline uint32_t crossing_id(uint32_t body_x, uint32_t edge_x, uint32_t edge_y) {
  return body_x == 0 ? mixed(edge_x, edge_y) : mixed(edge_y, edge_x);
}
/// Of the closest point of a body where it is none of its corners.
inline uint32_t closest_id(uint32_t body) {
  return mixed(2, body);
}

/// A ContactPoint; without its defaults, for there is room for many.
struct Candidate {
  Vec3 on_a, on_b;
  Real separation;
  uint32_t id;
};

/// Contact points, no two of the same features.
struct Candidates {
  static constexpr uint32_t kMax = 2 * SupportingFeature::kMaxCorners + 1;
  uint32_t count = 0;
  std::array<Candidate, kMax> points;

  void add(const Candidate& p) {
    for (uint32_t k = 0; k < count; ++k)
      if (points[k].id == p.id) return;
    if (count < kMax) points[count++] = p;
  }
  Real least_separation() const {
    Real least = std::numeric_limits<Real>::infinity();
    for (uint32_t k = 0; k < count; ++k) least = std::min(least, points[k].separation);
    return least;
  }
};

/// Gives the manifold, whose normal is known, at most four of the points: all of them, or the deepest, the
/// farthest from it, the one that spans the largest triangle with both, and the one that adds most to it.
/// What is level within `slop` is equally deep. `more`, if there is one, gets four of those left out.
void reduce(Manifold& m, const Candidates& c, Real slop, Manifold* more = nullptr);

/// Leaves out the points that are not farther apart than `least` [m].
void drop_below(Manifold& m, Real least);

}  // namespace offstage::sim
