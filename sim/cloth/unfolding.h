#pragma once
/// Private: unfolds the triangles of a cloth at rest into a plane.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/cloth/cloth_points.h"

namespace offstage::sim {

/// A triangle after it was unfolded into a plane.
struct FlatTriangle {
  uint32_t triangle;
  std::array<Eigen::Vector2d, 3> corners;  ///< [m]
};

/// A cloth at rest. Its triangles can be unfolded into the plane of any one of them.
class Unfolding {
 public:
  static constexpr uint32_t kNone = ~0u;  ///< in place of a triangle's number: there is none

  /// The lists must outlive this object.
  Unfolding(std::span<const Vec3> rest, std::span<const Triangle> triangles);
  std::span<const Vec3> rest() const { return rest_; }
  std::span<const Triangle> triangles() const { return triangles_; }
  /// Returns the triangle across edge k of triangle t, which begins at corner k; kNone if there is none, or
  /// more than one.
  uint32_t neighbour(uint32_t t, std::size_t k) const { return neighbours_[t][k]; }
  /// Returns a triangle in its own plane: the first corner is at the origin, and the first edge is along x.
  FlatTriangle own_plane(uint32_t t) const;
  /// Returns the triangles around a point, unfolded into the plane of one of them. With `wide` it adds the
  /// triangles around their points.
  std::vector<FlatTriangle> fan(uint32_t point, bool wide) const;
  /// Unfolds triangle u, the neighbour across edge k of the unfolded triangle `from`.
  FlatTriangle unfold(uint32_t u, const FlatTriangle& from, std::size_t k) const;

 private:
  std::span<const Vec3> rest_;
  std::span<const Triangle> triangles_;
  std::vector<std::array<uint32_t, 3>> neighbours_;
  std::vector<uint32_t> first_at_;  // by point: one of its triangles
};

}  // namespace offstage::sim
