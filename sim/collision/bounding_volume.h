#pragma once
/// The volumes of bounding trees (physics H1-H3): axis-aligned box, oriented box and sphere, and how they are
/// fitted to points. volume_pair.h has the overlap tests.

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
/// that inner points do not tilt it. The hull is that of the points that are extreme in 24 directions, so it
/// is exact for up to 24 points. For flat sets one axis is perpendicular to their plane; for straight ones
/// one axis is along their line. For three points the box is along their longest side, because it is the
/// smallest. Needs at least one point.
Obb fit_obb(std::span<const Vec3> points);
/// Smallest box along the given axes.
Obb fit_obb(std::span<const Vec3> points, const Mat3& axes);

/// After Ritter, "An efficient bounding sphere" (1990). The two farthest of the six points that are extreme
/// along the axes give a first diameter, and each point outside enlarges the sphere as little as possible. At
/// the end the radius is reduced to the distance of the farthest point. Needs at least one point.
BoundingSphere fit_sphere(std::span<const Vec3> points);

}  // namespace offstage::sim
