#pragma once
/// Random convex polyhedra, and pairs of them that are difficult for distance algorithms. Examples: parallel
/// faces or edges, exact contact, gaps of the size of rounding errors, very different sizes.

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "convex_oracle.h"
#include "random.h"
#include "sim/core/rotation.h"
#include "sim/geometry/convex_hull.h"

namespace offstage::sim {

/// A pseudo-random sequence, the same for the same seed on every machine.
class Dice {
 public:
  explicit Dice(uint64_t seed) : scatter_{seed} {}

  Real uniform(Real low = 0, Real high = 1) { return low + (high - low) * scatter_.uniform(next_++, 0); }
  /// Returns a number from 0 to count - 1.
  uint32_t index(std::size_t count) { return static_cast<uint32_t>(uniform() * static_cast<Real>(count)); }
  bool chance(Real probability) { return uniform() < probability; }
  Vec3 in_cube() { return {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}; }
  Vec3 direction() {
    const Real y = uniform(-1, 1), phi = uniform(0, 2 * std::numbers::pi), r = std::sqrt(1 - y * y);
    return {r * std::cos(phi), y, r * std::sin(phi)};
  }
  Quat rotation() { return Quat(Eigen::AngleAxisd(uniform(0, 2 * std::numbers::pi), direction())); }

 private:
  Scatter scatter_;
  uint64_t next_ = 0;
};

/// Returns a random polyhedron around the origin, roughly `size` [m] wide. It is the hull of points in a ball
/// or on a sphere, a box, a prism, a needle, a plate, a polygon, a segment or a point.
inline ConvexPolyhedron random_polyhedron(Dice& dice, uint32_t points, Real size) {
  enum Kind { kCloud, kSphere, kBox, kPrism, kNeedle, kPlate, kPolygon, kSegment, kPoint };
  constexpr std::array kKinds = {kCloud, kCloud, kCloud,  kCloud, kSphere,  kSphere,  kSphere,  kBox,
                                 kPrism, kPrism, kNeedle, kPlate, kPolygon, kPolygon, kSegment, kPoint};
  const Kind kind = kKinds[dice.index(kKinds.size())];
  if (kind == kBox) return box_polyhedron(size * (Vec3::Constant(1.1) + dice.in_cube()));
  const uint32_t count = kind == kPoint ? 1 : kind == kSegment ? 2 : points;
  const Mat3 R = dice.rotation().toRotationMatrix();
  const Real thin = std::pow(10, dice.uniform(-6, -1));
  std::vector<Vec3> cloud;
  for (uint32_t i = 0; i < count; ++i) {
    Vec3 p = kind == kSphere ? dice.direction() : dice.in_cube();
    if (kind == kNeedle) p = p.cwiseProduct(Vec3(1, thin, thin));
    if (kind == kPlate) p.y() *= thin;
    if (kind == kPolygon || kind == kPrism) p.y() = 0;
    const bool lid = kind == kPrism && i % 2 == 1;
    cloud.push_back(lid ? Vec3(cloud.back() + size * R.col(1)) : Vec3(size * (R * p)));
  }
  return convex_hull(cloud);
}

struct ConvexPair {
  ConvexPolyhedron a, b;
  Pose a_from_b;

  Real size() const { return a.reach() + b.reach(); }
  Separation exact() const { return brute_force_separation(a, b, a_from_b); }
};

/// Returns a rotation of B: random, none, or one that makes a face or edge of B parallel to a face or edge of
/// A.
inline Quat feature_rotation(const ConvexPair& pair, Dice& dice) {
  const auto &a = pair.a, &b = pair.b;
  const uint32_t choice = dice.index(5);
  if (choice == 0 && a.face_count() > 0 && b.face_count() > 0)
    return rotation_between(b.plane(dice.index(b.face_count())).normal,
                            -a.plane(dice.index(a.face_count())).normal);
  if (choice == 1 && !a.edges().empty() && !b.edges().empty()) {
    const auto e = a.edge(dice.index(a.edges().size())), f = b.edge(dice.index(b.edges().size()));
    return rotation_between(b.vertex(f.head) - b.vertex(f.tail), a.vertex(e.head) - a.vertex(e.tail));
  }
  return choice == 2 ? Quat::Identity() : dice.rotation();
}

/// Returns two polyhedra of up to `points` vertices and of sizes from 1 mm to 100 m. They are apart, touch or
/// overlap. In some pairs the position of B is random; in others B is moved along the normal to a certain
/// distance from A.
inline ConvexPair random_pair(Dice& dice, uint32_t points) {
  const Real size = std::pow(10, dice.uniform(-3, 2)),
             smaller = size * (dice.chance(0.5) ? 1 : dice.uniform(0.01, 1));
  ConvexPair pair{random_polyhedron(dice, 4 + dice.index(points - 3), size),
                  random_polyhedron(dice, 4 + dice.index(points - 3), smaller),
                  {}};
  pair.a_from_b = {dice.uniform(0, 2) * pair.size() * dice.direction(), feature_rotation(pair, dice)};
  if (dice.chance(0.3)) return pair;

  constexpr std::array kGaps = {0.1,    0.01,   1e-4,  1e-8,  1e-12, 1e-15, 0.0,
                                -1e-15, -1e-12, -1e-8, -1e-3, -0.1,  -0.5};
  const Separation s = pair.exact();
  pair.a_from_b.position += (s.distance - smaller * kGaps[dice.index(kGaps.size())]) * s.normal;
  return pair;
}

}  // namespace offstage::sim
