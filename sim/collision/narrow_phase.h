#pragma once
/// Narrow phase: distance, contacts and time of impact of two shapes of any kind at given poses (physics
/// R3-R5, R12). Pairs of convex pieces are found by traversing both trees. Each pair is measured by GJK or
/// V-Clip. The distance of two shapes with Options::by_triangles is measured by the closest points of two
/// triangles. All results are in the frame of the first shape, A, and normals point from B to A. Only the
/// second shape can be a plane.

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "sim/collision/collision_shape.h"
#include "sim/collision/gjk.h"
#include "sim/collision/manifold.h"
#include "sim/collision/time_of_impact.h"
#include "sim/collision/tree_pair.h"
#include "sim/collision/vclip.h"

namespace offstage::sim {

/// Algorithm for the distance of two polyhedra. Both algorithms give the same results. Round pieces always
/// use GJK.
enum class DistanceMethod : uint8_t { gjk, vclip };

/// Data of a pair of shapes kept between queries. It makes the next query faster and does not change results
/// beyond rounding.
class PairCache {
 public:
  struct Entry {
    uint32_t piece_a, piece_b;
    GjkCache gjk;
    VclipCache vclip;
    /// For a piece that is a triangle: the side of the triangle on which the other piece is
    /// (SurfaceTriangle::side); 0 if unknown. While the other piece penetrates the triangle, the side does
    /// not change.
    int8_t side_of_a = 0, side_of_b = 0;
  };
  /// Returns the entry of a pair of pieces. The entry is created if it does not exist. The reference is valid
  /// until the next call of this function.
  Entry& of(uint32_t piece_a, uint32_t piece_b);
  /// Returns the entry of a pair of pieces; null if there is none.
  const Entry* find(uint32_t piece_a, uint32_t piece_b) const;
  /// Removes the entries that of() has not returned since the last call of this function.
  void forget_unused();

  /// Number of tests in all queries with this cache.
  TestCounts tests;
  /// Whether the shapes are at their actual poses, not at predicted ones. Only then are Entry::side_of_a and
  /// side_of_b stored.
  bool keeps_sides = true;

 private:
  struct Used : Entry {
    bool used = true;
  };
  uint32_t index_of(uint32_t piece_a, uint32_t piece_b) const;
  std::size_t slot_of(uint32_t piece_a, uint32_t piece_b) const;
  void rebuild_slots();

  std::vector<Used> entries_;  // in the order of their first use
  /// Hash table with linear probing: indices of entries by their pieces, or kNoEntry. At most half of the
  /// table is in use. The table is empty while there are few entries, because a linear search is then faster.
  std::vector<uint32_t> slots_;
};

/// Returns the separation of the two closest (or most deeply penetrating) pieces; empty if all pairs of
/// pieces are farther apart than `limit` [m]. A piece inside a hollow shape also counts as penetrating.
std::optional<Separation> separation(const CollisionShape& a, const CollisionShape& b, const Pose& a_from_b,
                                     PairCache& cache, DistanceMethod method = DistanceMethod::gjk,
                                     Real limit = std::numeric_limits<Real>::infinity());

/// Returns the separation of piece i of A and piece j of B, without a cache.
Separation piece_separation(const CollisionShape& a, uint32_t i, const CollisionShape& b, uint32_t j,
                            const Pose& a_from_b);

/// Whether the shapes have a point in common. The tests are added to `counts`.
bool touching(const CollisionShape& a, const CollisionShape& b, const Pose& a_from_b, TestCounts& counts);
bool touching(const CollisionShape& a, const CollisionShape& b, const Pose& a_from_b);

/// Appends the manifolds of all pairs of pieces within `margin` [m] of each other, in an order that depends
/// only on the shapes. Whatever the method is, two boxes use the separating axis test, and spheres use closed
/// forms. If the shapes turn relative to each other (`turning`), points that may touch next are added as
/// further manifolds (`more` of manifold()). The manifolds of a piece with coplanar triangles are joined.
void find_manifolds(const CollisionShape& a, const CollisionShape& b, const Pose& a_from_b, Real margin,
                    PairCache& cache, DistanceMethod method, std::vector<Manifold>& manifolds,
                    bool turning = false);

/// A moving shape.
struct MovingShape {
  const CollisionShape& shape;
  const PosePath& path;
  TestCounts* counts =
      nullptr;  ///< if not null in the first shape, the tests of the query are added to these counts
};

/// Returns the time, as a fraction of the step, at which the distance of the shapes is at most `tolerance`
/// [m], > 0. Before this time the distance is never less than half of the tolerance. Returns nothing if the
/// distance stays more than half of the tolerance. The time is 0 for shapes that are within the tolerance at
/// the start, or one inside the other. The method is conservative advancement over both trees at once, with a
/// bound on the motion per node: Tang, Kim, Manocha, "C2A: controlled conservative advancement for continuous
/// collision detection of polygonal models" (2009).
std::optional<Impact> time_of_impact(const MovingShape& a, const MovingShape& b, Real tolerance);

/// Returns the same time as time_of_impact(), found by bisection of the step as in the book. An impact is
/// detected only if the shapes overlap at the end of the step.
std::optional<Impact> bisected_time_of_impact(const MovingShape& a, const MovingShape& b, Real tolerance);

/// Returns the time of the next impact, as a fraction of the step, for shapes that are within the tolerance
/// at the start; nothing if there is none. An impact occurs when their nearest or deepest points approach
/// faster than `speed` [m per step], > 0, plus the deviation of the rotation from a constant rate. The motion
/// is sampled until the shapes are separate, because conservative advancement makes no progress within the
/// tolerance.
std::optional<Impact> time_of_next_impact(const MovingShape& a, const MovingShape& b, Real tolerance,
                                          Real speed);

}  // namespace offstage::sim
