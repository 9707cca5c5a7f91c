#pragma once
/// Narrow phase: what happens between two placed shapes of any kind (physics R3-R5, R12). Pairs of their
/// convex pieces are found tree against tree, and each is put to GJK or V-Clip. Everything is reported in the
/// frame of the first shape, A, with normals from B to A. A plane can only be the second, and not both can be
/// planes.

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "sim/collision/collision_shape.h"
#include "sim/collision/gjk.h"
#include "sim/collision/manifold.h"
#include "sim/collision/time_of_impact.h"
#include "sim/collision/vclip.h"

namespace offstage::sim {

/// Which algorithm measures pairs of polyhedra; both give the same answers. Round pieces always go to GJK.
enum class DistanceMethod : uint8_t { gjk, vclip };

/// What is remembered of a pair of shapes from one query to the next. It makes the next quick and changes no
/// answer beyond rounding.
class PairCache {
 public:
  struct Entry {
    uint32_t piece_a, piece_b;
    GjkCache gjk;
    VclipCache vclip;
    /// Of pieces that are triangles: on which side of it the other piece is (SurfaceTriangle::side); 0 if it
    /// is not known. What penetrates a triangle stays on the side from which it came.
    int8_t side_of_a = 0, side_of_b = 0;
  };
  /// The entry of a pair of pieces, fresh if there was none. Valid until the next call.
  Entry& of(uint32_t piece_a, uint32_t piece_b);
  /// The same if there is one, else null.
  const Entry* find(uint32_t piece_a, uint32_t piece_b) const;
  /// Forgets the pieces that were not asked for since the last call.
  void forget_unused();

  /// Whether the shapes are where they really were: only then are sides kept.
  bool keeps_sides = true;

 private:
  struct Used : Entry {
    bool used = true;
  };
  std::vector<Used>::const_iterator place_of(uint32_t piece_a, uint32_t piece_b) const;
  std::vector<Used> entries_;  // ascending by pieces
};

/// Signed distance of the closest, or deepest, two pieces; none if all are farther than `limit` [m].
/// Something inside a hollow shape is in penetration, too.
std::optional<Separation> separation(const CollisionShape& a, const CollisionShape& b, const Pose& a_from_b,
                                     PairCache& cache, DistanceMethod method = DistanceMethod::gjk,
                                     Real limit = std::numeric_limits<Real>::infinity());

/// Whether the shapes have a point in common.
bool touching(const CollisionShape& a, const CollisionShape& b, const Pose& a_from_b);

/// Appends the manifolds of all pairs of pieces within `margin` [m] of each other, in an order that depends
/// on the shapes alone. Whatever the method, two boxes have the separating axis test, and spheres closed
/// forms. Of shapes that turn against each other it tells also what may touch next, as further manifolds
/// (`more` of manifold()).
void find_manifolds(const CollisionShape& a, const CollisionShape& b, const Pose& a_from_b, Real margin,
                    PairCache& cache, DistanceMethod method, std::vector<Manifold>& manifolds,
                    bool turning = false);

/// A shape on its way.
struct MovingShape {
  const CollisionShape& shape;
  const PosePath& path;
};

/// A share of the step at which the shapes are within `tolerance` [m], > 0, of each other, and before which
/// they are never within half of it; none if they stay more than half of it apart. Shapes that begin within
/// it, or one inside the other, have their impact at share 0. Conservative advancement over both trees at
/// once, with a bound on the motion per node: Tang, Kim, Manocha, "C2A: controlled conservative advancement
/// for continuous collision detection of polygonal models" (2009).
std::optional<Impact> time_of_impact(const MovingShape& a, const MovingShape& b, Real tolerance);

/// The same of shapes that are within the tolerance at the start, and may stay so or part: when their
/// nearest, or deepest, points approach each other faster than `speed` [m per step], > 0, and than the rate
/// of the turn is off even. As there is always something near, these are looked at here and there on the way,
/// up to where the shapes are apart.
std::optional<Impact> time_of_next_impact(const MovingShape& a, const MovingShape& b, Real tolerance,
                                          Real speed);

}  // namespace offstage::sim
