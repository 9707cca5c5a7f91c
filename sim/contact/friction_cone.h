#pragma once
/// Coulomb's law of one contact as convex sets for projections:
/// - the friction cone of the impulses (p_n, p_t, p_k), for the exact solver, which computes p_n and friction
/// together. It is round for isotropic friction, and a pyramid if each axis has its own limit;
/// - the section of the cone at a given normal impulse, a disc or a rectangle, for solvers that compute p_n
/// first and then friction;
/// - the limits of spinning and rolling.
/// The fast solver has its own version for eight patches in SIMD lanes (patch_friction.h).

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
  // The projection is on a face or an edge of the pyramid; the names give the active limits.
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

/// Projects an impulse q = (n, t, k) [N s] onto Coulomb's friction cone of a contact. A point at the apex
/// counts as inside the cone. Otherwise the contacts of a stack at rest would become active one after the
/// other from the bottom up, instead of all at once.
ConeProjection project_on_cone(const Contact& c, const Vec3& q);

/// Derivative of the projection at a point q. It is symmetric, with eigenvalues between 0 and 1.
Mat3 cone_derivative(const Contact& c, const Vec3& q, const ConeProjection& projection);

/// Returns the term mu |u_t| that De Saxce and Feng add to the normal velocity [m/s]; for a pyramid, mu_t
/// |u_t| + mu_k |u_k|. `u` is the relative velocity in the contact's frame.
Real cone_lift(const Contact& c, const Vec3& u);

/// Projects an impulse `p` = (n, t, k) [N s]: its normal part is at least 0, and its tangential part is
/// within the friction limits of the normal impulse `normal` >= 0.
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

/// Returns the vector, or the vector scaled down to the length `limit` >= 0 if it is longer.
template <class Vector>
Vector shortened(const Vector& v, Real limit) {
  const Real length = v.norm();
  return length > limit ? Vector(limit / length * v) : v;
}

/// Greatest arm s for which sliding and spinning friction share one limit [m]. A longer arm occurs only at
/// surfaces with very little sliding friction; sliding and spinning then have separate limits.
inline constexpr Real kLongestSpinArm = 0.1;

/// Returns the arm s [m]: spinning at the angular velocity w counts as sliding at the velocity s w. It is 0
/// if there is no spinning friction, or if sliding and spinning have separate limits.
inline Real spin_arm(const Contact& c) {
  const bool is_common = c.is_isotropic() && c.spinning <= kLongestSpinArm * c.friction_t;
  return is_common && c.spinning > 0 ? c.spinning / c.friction_t : 0;
}

}  // namespace offstage::sim
