#pragma once
/// Coulomb's limits of a contact's impulse as a convex set for projections: p_n >= 0, and the tangential part
/// in a disc (isotropic friction) or a rectangle (one limit per axis), whose size is given by a normal
/// impulse.

#include <algorithm>
#include <cmath>

#include "sim/contact/contact_problem.h"

namespace offstage::sim {

/// The nearest allowed impulse to `p`, with tangential limits from the normal impulse `normal` >= 0.
inline Vec3 projected(const Contact& c, const Vec3& p, Real normal) {
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

/// Sliding and spinning friction have one common limit up to this arm; a longer one belongs to surfaces that
/// are nearly without friction, and then each has its own limit [m].
inline constexpr Real kLongestSpinArm = 0.1;

/// The arm s at which spinning counts as sliding [m]; 0 if sliding and spinning are limited separately: no
/// spinning friction, or a friction axis.
inline Real spin_arm(const Contact& c) {
  const bool is_common = c.is_isotropic() && c.spinning <= kLongestSpinArm * c.friction_t;
  return is_common && c.spinning > 0 ? c.spinning / c.friction_t : 0;
}

}  // namespace offstage::sim
