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

}  // namespace offstage::sim
