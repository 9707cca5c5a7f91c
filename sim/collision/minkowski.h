#pragma once
/// The Minkowski difference A - B = {a - b} of two cores in A's frame, represented by its support mapping. It
/// contains the origin if the cores overlap. Otherwise its point nearest to the origin is the vector between
/// the closest points of the cores.

#include <limits>

#include "sim/collision/convex.h"
#include "sim/core/types.h"

namespace offstage::sim {

/// Vertex numbers of a point of A's core and of a point of B's core; see Convex::support().
struct VertexPair {
  uint32_t a = 0, b = 0;
  bool operator==(const VertexPair&) const = default;
};

/// A support point of A - B.
struct SupportPoint {
  Vec3 w;  ///< the point
  Vec3 a;  ///< the corresponding point of A's core
  VertexPair from;
};

class MinkowskiDifference {
 public:
  MinkowskiDifference(const Convex& a, const Convex& b, const Pose& a_from_b)
      : a_(a), b_(b), R_(a_from_b.orientation.toRotationMatrix()), t_(a_from_b.position) {}

  /// Returns the point of A - B that is lowest along `d`, which need not be a unit vector. The search over
  /// vertices starts at `hint`.
  SupportPoint lowest(const Vec3& d, VertexPair hint) const {
    SupportPoint p;
    p.from = hint;
    p.a = a_.support(-d, p.from.a);
    p.w = p.a - place(b_.support(R_.transpose() * d, p.from.b));
    return p;
  }
  /// Returns the difference of the two vertices with these numbers.
  SupportPoint at(VertexPair from) const {
    const Vec3 a = a_.vertex(from.a);
    return {a - place(b_.vertex(from.b)), a, from};
  }
  /// Whether all points returned by lowest() are differences of vertices.
  bool has_vertices() const { return a_.has_vertices() && b_.has_vertices(); }
  /// A point inside A - B.
  Vec3 centre() const { return a_.centre() - place(b_.centre()); }
  /// Approximate bound of the rounding error of the points of A - B [m].
  Real rounding() const {
    return std::numeric_limits<Real>::epsilon() * (a_.reach() + b_.reach() + t_.norm());
  }
  /// Sum of the radii around the cores [m].
  Real radius() const { return a_.radius + b_.radius; }
  Real radius_a() const { return a_.radius; }

 private:
  Vec3 place(const Vec3& in_b) const { return R_ * in_b + t_; }

  const Convex &a_, &b_;
  Mat3 R_;  ///< A's frame from B's
  Vec3 t_;
};

}  // namespace offstage::sim
