#pragma once
/// The volumes of bounding trees (physics H1-H3), axis-aligned box, oriented box and sphere, and how they are
/// fitted to points. Whether two of them overlap: volume_pair.h.

#include <span>

#include "sim/core/types.h"

namespace offstage::sim {

struct Obb {
  Vec3 centre = Vec3::Zero();
  Vec3 half = Vec3::Zero();      ///< half sizes along the axes [m]
  Mat3 axes = Mat3::Identity();  ///< orthonormal columns, right-handed
};

struct BoundingSphere {
  Vec3 centre = Vec3::Zero();
  Real radius = 0;  ///< [m]
};

/// Box along the eigenvectors of the area-weighted covariance of the triangles of the points' convex hull, so
/// that points inside do not tilt it. The hull is that of the points that are extreme in 24 directions: exact
/// for up to 24 points. Flat sets have one axis at right angles to their plane, straight ones one along their
/// line. Three points have the box along their longest side, for it is the smallest. At least one point.
Obb fit_obb(std::span<const Vec3> points);
/// Smallest box along given axes.
Obb fit_obb(std::span<const Vec3> points, const Mat3& axes);

/// After Ritter, "An efficient bounding sphere" (1990): the two farthest of the six points that are extreme
/// along the axes give a first diameter, and each point outside grows the sphere just enough to hold it. Its
/// centre is kept and the radius reduced to the farthest point. At least one point.
BoundingSphere fit_sphere(std::span<const Vec3> points);

}  // namespace offstage::sim
