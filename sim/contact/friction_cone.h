#pragma once
/// The cone of a contact's impulses, (p_t, p_k) within what p_n allows, as a convex set for projections. It
/// is a round cone for isotropic friction, and a pyramid if each axis has its own limit.

#include <cstdint>

#include "sim/contact/contact_problem.h"

namespace offstage::sim {

/// Part of a cone that contains the projection of a point.
enum class ConeRegion : uint8_t {
  apex,     ///< the projection is zero
  inside,   ///< the projection is the point itself
  surface,  ///< the projection is on the round cone
  // Pyramid: on a face or an edge, by the signs of the active limits.
  low_t,
  high_t,
  low_k,
  high_k,
  low_low,
  low_high,
  high_low,
  high_high,
};

struct ConeProjection {
  Vec3 point;
  ConeRegion region;
};

/// Projects a point on the cone of a contact. The apex itself counts as inside, so that all contacts of a
/// stack at rest close at once and not from the bottom up.
ConeProjection project_on_cone(const Contact& c, const Vec3& q);

/// Derivative of the projection at a point q. It is symmetric, with eigenvalues between 0 and 1.
Mat3 cone_derivative(const Contact& c, const Vec3& q, const ConeProjection& projection);

/// Shift mu |u_t| of the normal velocity (De Saxce and Feng); for a pyramid mu_t |u_t| + mu_k |u_k|.
Real cone_lift(const Contact& c, const Vec3& u);

}  // namespace offstage::sim
