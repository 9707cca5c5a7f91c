#include "sim/contact/friction_cone.h"

#include <cmath>
#include <limits>

namespace offstage::sim {
namespace {

/// The active limits of the pyramid: the sign of p_t and the sign of p_k, or 0 for a limit that is not
/// active.
struct Reached {
  ConeRegion region;
  int t, k;
};
constexpr Reached kPyramid[] = {
    {ConeRegion::low_t, -1, 0},    {ConeRegion::high_t, 1, 0},    {ConeRegion::low_k, 0, -1},
    {ConeRegion::high_k, 0, 1},    {ConeRegion::low_low, -1, -1}, {ConeRegion::low_high, -1, 1},
    {ConeRegion::high_low, 1, -1}, {ConeRegion::high_high, 1, 1},
};

/// Returns the derivative of the projection on the face or edge of the pyramid where these limits are active:
/// P P^T / P^2 for p_n and the limited axes. The derivative for the other axis is 1.
Mat3 pyramid_derivative(const Contact& c, int t, int k) {
  const Vec3 along(1, t * c.friction_t, k * c.friction_k);
  Mat3 D = along * along.transpose() / along.squaredNorm();
  if (t == 0) D(1, 1) = 1;
  if (k == 0) D(2, 2) = 1;
  return D;
}

ConeProjection project_on_pyramid(const Contact& c, const Vec3& q) {
  const auto inside = [&](const Vec3& p) {
    return p.x() >= 0 && std::abs(p.y()) <= c.friction_t * p.x() * (1 + 1e-12) &&
           std::abs(p.z()) <= c.friction_k * p.x() * (1 + 1e-12);
  };
  if (inside(q)) return {q, ConeRegion::inside};
  ConeProjection best{Vec3::Zero(), ConeRegion::apex};
  Real nearest = q.squaredNorm();
  for (const Reached& r : kPyramid) {
    const Vec3 p = pyramid_derivative(c, r.t, r.k) * q;
    const Real distance = (p - q).squaredNorm();
    if (distance < nearest && inside(p)) {
      nearest = distance;
      best = {p, r.region};
    }
  }
  return best;
}

}  // namespace

ConeProjection project_on_cone(const Contact& c, const Vec3& q) {
  if (!c.is_isotropic()) return project_on_pyramid(c, q);
  const Real mu = c.friction_t, length = std::sqrt(q.y() * q.y() + q.z() * q.z());
  if (q.x() >= 0 && length <= mu * q.x()) return {q, ConeRegion::inside};
  if (mu * length <= -q.x()) return {Vec3::Zero(), ConeRegion::apex};
  const Real normal = (q.x() + mu * length) / (1 + mu * mu), fraction = mu * normal / length;
  return {{normal, fraction * q.y(), fraction * q.z()}, ConeRegion::surface};
}

Mat3 cone_derivative(const Contact& c, const Vec3& q, const ConeProjection& projection) {
  switch (projection.region) {
    case ConeRegion::apex:
      return Mat3::Zero();
    case ConeRegion::inside:
      return Mat3::Identity();
    case ConeRegion::surface: {
      const Real mu = c.friction_t, length = std::sqrt(q.y() * q.y() + q.z() * q.z());
      const Vec3 out(0, q.y() / length, q.z() / length), across(0, -out.z(), out.y());
      const Vec3 along = Vec3(1, 0, 0) + mu * out;
      return along * along.transpose() / (1 + mu * mu) +
             mu * projection.point.x() / length * across * across.transpose();
    }
    default:
      for (const Reached& r : kPyramid)
        if (r.region == projection.region) return pyramid_derivative(c, r.t, r.k);
  }
  return Mat3::Zero();
}

Real cone_lift(const Contact& c, const Vec3& u) {
  if (!c.is_isotropic()) return c.friction_t * std::abs(u.y()) + c.friction_k * std::abs(u.z());
  return c.friction_t * std::sqrt(u.y() * u.y() + u.z() * u.z());
}

}  // namespace offstage::sim
