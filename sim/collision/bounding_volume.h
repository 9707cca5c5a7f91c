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

/// Returns a tight oriented box around at least one point. Its axes are the eigenvectors of the area-weighted
/// covariance of the surface of the convex hull, so that inner points do not affect them. The hull is
/// computed from the points that are extreme in 24 directions, and is therefore exact for up to 24 points.
/// For coplanar points one axis is perpendicular to their plane; for collinear points one axis is along their
/// line. For three points one axis is along the longest side, which gives the smallest box.
Obb fit_obb(std::span<const Vec3> points);
/// Returns the smallest box with the given axes around at least one point.
Obb fit_obb(std::span<const Vec3> points, const Mat3& axes);

/// Returns a sphere around at least one point, after Ritter, "An efficient bounding sphere" (1990). Of the
/// six points that are extreme along the axes, the two that are farthest apart give the first diameter. Each
/// point outside then enlarges the sphere as little as possible. At the end the radius is reduced to the
/// distance of the farthest point.
BoundingSphere fit_sphere(std::span<const Vec3> points);

}  // namespace offstage::sim
