#pragma once
/// Private: the second derivatives on the triangles of a cloth at rest, as weights of points (see bending.h).

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "sim/cloth/unfolding.h"

namespace offstage::sim {

/// The second derivatives xx, yy and sqrt(2) xy on a triangle.
struct TrianglePatch {
  std::map<uint32_t, Vec3> weights;  ///< by point [1/m^2]
  Vec3 rest = Vec3::Zero();          ///< unstressed curvature [1/m]
  Real divisor = 1;                  ///< the norm of the derivatives divided by this counts as curvature
};

/// The two patches of a triangle. `smooth` is computed from recovered gradients. `rough` measures shapes that
/// these gradients cannot see: by the jumps of the gradients at the edges or, at a clamp, by the rise along
/// the edges. Its curvature counts half, since next to a border or a crease of a smooth surface, the
/// curvature by jumps can be too large by as much as the curvature itself.
struct TrianglePatches {
  Real area;  ///< [m^2]
  TrianglePatch smooth, rough;
};

/// The gradient at a point, in the plane of the first triangle of its fan.
struct RecoveredGradient {
  std::vector<FlatTriangle> fan;
  std::map<uint32_t, Eigen::Vector2d> weights;  ///< by point [1/m]
  bool clamped = false;                         ///< whether it is the gradient of clamped triangles
};

/// Computes the patches of triangles.
class BendingPatches {
 public:
  /// `clamped`: by triangle, whether it does not bend; `rest_fraction`: see ClothBending::assign(). The lists
  /// must outlive this object.
  BendingPatches(std::span<const Vec3> rest, std::span<const Triangle> triangles,
                 std::span<const uint8_t> clamped, Real rest_fraction)
      : unfolding_(rest, triangles),
        clamped_(clamped),
        rest_fraction_(rest_fraction),
        recovered_(rest.size()) {}
  /// Returns the patches of a triangle; nothing if it is clamped or has no area.
  std::optional<TrianglePatches> of(uint32_t t);

 private:
  Unfolding unfolding_;
  std::span<const uint8_t> clamped_;
  Real rest_fraction_;
  std::vector<std::optional<RecoveredGradient>> recovered_;  // by point; computed on first use
};

}  // namespace offstage::sim
