#pragma once
/// The cone of a contact's impulses, (p_t, p_k) within what p_n allows, as a set to project on: round for
/// isotropic friction, a pyramid where each axis has its own limit.

#include <cstdint>

#include "sim/contact/contact_problem.h"

namespace offstage::sim {

/// Where a point lies to a cone: which part of it is nearest.
enum class ConeRegion : uint8_t {
  apex,     ///< nothing of it remains
  inside,   ///< it stays as it is
  surface,  ///< on the round cone
  // Of the pyramid: on a face or an edge, by the signs of the limits that are reached.
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

/// The nearest point of the cone of a contact. Of the apex and the inside, which the corner belongs to both,
/// it is the inside: so that a stack at rest is closed all at once, not from the bottom up.
ConeProjection project_on_cone(const Contact& c, const Vec3& q);

/// The derivative of the projection, symmetric and between 0 and 1, of a point that was projected.
Mat3 cone_derivative(const Contact& c, const Vec3& q, const ConeProjection& projection);

/// mu |u_t| of De Saxce and Feng; of a pyramid mu_t |u_t| + mu_k |u_k|.
Real cone_lift(const Contact& c, const Vec3& u);

}  // namespace offstage::sim
