#pragma once
/// Coulomb's law of one contact as convex sets for projections:
/// - the cone of its impulses, (p_t, p_k) within what p_n allows, for the exact solver, which finds p_n and
///   friction together. It is round for isotropic friction, and a pyramid if each axis has its own limit;
/// - the section of the cone at a given normal impulse, a disc or a rectangle, for solvers that relax first
///   p_n and then friction;
/// - the limits of spinning and rolling.
/// The fast solver has the sections of eight patches in SIMD lanes (patch_friction.h).

#include <algorithm>
#include <cmath>
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

/// Projects an impulse q = (n, t, k) [N s] on Coulomb's friction cone of a contact. The apex itself counts as
/// inside, so that all contacts of a stack at rest close together, and not one after the other from the
/// bottom up.
ConeProjection project_on_cone(const Contact& c, const Vec3& q);

/// Derivative of the projection at a point q. It is symmetric, with eigenvalues between 0 and 1.
Mat3 cone_derivative(const Contact& c, const Vec3& q, const ConeProjection& projection);

/// Shift mu |u_t| of the normal velocity (De Saxce and Feng); for a pyramid mu_t |u_t| + mu_k |u_k|.
Real cone_lift(const Contact& c, const Vec3& u);

/// The nearest allowed impulse to `p`, with tangential limits from the normal impulse `normal` >= 0.
inline Vec3 project_on_section(const Contact& c, const Vec3& p, Real normal) {
  Vec3 q(std::max(p.x(), 0.0), p.y(), p.z());
  if (c.is_isotropic()) {
    const Real limit = c.friction_t * normal, length = std::sqrt(p.y() * p.y() + p.z() * p.z());
    if (length > limit) q.tail<2>() *= limit > 0 ? limit / length : 0;
  } else {
    const Real t = c.friction_t * normal, k = c.friction_k * normal;
    q.y() = std::clamp(p.y(), -t, t);
    q.z() = std::clamp(p.z(), -k, k);
  }
  return q;
}

using Tangential = Eigen::Matrix<Real, 2, 1>;  ///< components along t and k

/// A vector, shortened to a length of at most `limit` [>= 0].
template <class Vector>
Vector shortened(const Vector& v, Real limit) {
  const Real length = v.norm();
  return length > limit ? Vector(limit / length * v) : v;
}

/// Greatest arm s for which sliding and spinning friction share one limit [m]. A longer arm belongs to
/// surfaces that are nearly without friction; sliding and spinning then have separate limits.
inline constexpr Real kLongestSpinArm = 0.1;

/// The arm s at which spinning counts as sliding [m]; 0 if sliding and spinning are limited separately: no
/// spinning friction, or a friction axis.
inline Real spin_arm(const Contact& c) {
  const bool is_common = c.is_isotropic() && c.spinning <= kLongestSpinArm * c.friction_t;
  return is_common && c.spinning > 0 ? c.spinning / c.friction_t : 0;
}

}  // namespace offstage::sim
