#pragma once
/// Contact points before the selection for a manifold: their ids, and the choice of four among many.

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "sim/collision/manifold.h"
#include "sim/collision/supporting_feature.h"

namespace offstage::sim {

/// Fractions of the margin within which solids count as touching. kTilt limits by how much the gap along the
/// normal of a face may be smaller than the separation, and how far parallel edges may pass each other. kRim
/// limits how far a point may lie outside of a face, and how much deeper the true deepest point of a rim may
/// be than the deepest corner of its polygon.
inline constexpr Real kTilt = 0.05, kRim = 0.001;
/// Accuracy of separations, as a fraction of the solids' size.
inline constexpr Real kSeparationRounding = 1e-9;
/// A face never gives the contact normal if the sine of the angle between its normal and the separation's
/// normal exceeds this.
inline constexpr Real kMaxTilt = 0.05;
/// A face is not near the other solid if the cosine of the angle between its normal and the separation's
/// normal is less than this.
inline constexpr Real kNearFace = 0.9;
/// Directions count as parallel if the sine of the angle between them is less than this.
inline constexpr Real kParallel = 1e-6;

/// If the sines of the inclinations of two faces differ by less than this, the face of the larger solid gives
/// the normal; for solids of equal size, A's face. The ids of the points therefore stay constant while the
/// solids rock.
inline constexpr Real kAlike = 1e-3;
/// Whether A's face, not B's, gives the contact normal. `tilt`: sine of the inclination of each face;
/// `reach`: size of each solid.
inline bool a_gives_normal(Real tilt_a, Real tilt_b, Real reach_a, Real reach_b) {
  return reach_a >= reach_b ? tilt_a <= tilt_b + kAlike : tilt_a + kAlike < tilt_b;
}

// Ids of contact points. `body` is 0 for A and 1 for B; tags are defined by SupportingFeature.

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
/// Returns the id of the crossing of an edge of one body and an edge of the other body.
inline uint32_t crossing_id(uint32_t body_x, uint32_t edge_x, uint32_t edge_y) {
  return body_x == 0 ? mixed(edge_x, edge_y) : mixed(edge_y, edge_x);
}
/// Returns the id of a contact at the closest point of a body, if this point is not a corner of the body.
inline uint32_t closest_id(uint32_t body) {
  return mixed(2, body);
}

/// A ContactPoint without default values, so that an array of many costs no initialization.
struct Candidate {
  Vec3 on_a, on_b;
  Real separation;
  uint32_t id;
  uint32_t piece = 0;
};

/// Contact points; no two of them have the same features.
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

/// Selects at most four of the points for the manifold, whose normal must be set. If there are more than
/// four, the selection is: the deepest point, the point farthest from it, the point that spans the largest
/// triangle with both, and the point that adds the most area to this triangle. Depths that differ by less
/// than `slop` [m] count as equal. `more`, if not null, gets up to four of the remaining points; points are
/// identified by their ids.
void reduce(Manifold& m, std::span<const Candidate> c, Real slop);
void reduce(Manifold& m, const Candidates& c, Real slop, Manifold* more = nullptr);

/// Removes the points whose separation is not greater than `least` [m].
void drop_below(Manifold& m, Real least);

}  // namespace offstage::sim
