#include "sim/contact/friction_cone.h"

#include <algorithm>
#include <cmath>

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

ConeRegion pyramid_region(int t, int k) {
  return std::ranges::find_if(kPyramid, [&](const Reached& r) { return r.t == t && r.k == k; })->region;
}

/// The normal impulse p_n of the nearest point is where the derivative of the squared distance,
///   p_n - q_n - mu_t max(|q_t| - mu_t p_n, 0) - mu_k max(|q_k| - mu_k p_n, 0),
/// is zero. It increases with p_n, so the active limits follow from its sign where a limit becomes inactive.
/// They must not be found by comparing distances: at a point that slides, |q| is 1e6 times the impulse, and
/// rounding would hide the differences.
ConeProjection project_on_pyramid(const Contact& c, const Vec3& q) {
  const Real mu_t = c.friction_t, mu_k = c.friction_k, t = std::abs(q.y()), k = std::abs(q.z());
  if (q.x() >= 0 && t <= mu_t * q.x() && k <= mu_k * q.x()) return {q, ConeRegion::inside};
  Real normal = (q.x() + mu_t * t + mu_k * k) / (1 + mu_t * mu_t + mu_k * mu_k);
  if (normal <= 0) return {Vec3::Zero(), ConeRegion::apex};
  // The limit of t is active up to the normal impulse t / mu_t, and that of k up to k / mu_k.
  const bool t_is_last = t * mu_k >= k * mu_t;
  const bool limits_t = t_is_last || mu_t * normal < t, limits_k = !t_is_last || mu_k * normal < k;
  if (!limits_k) normal = (q.x() + mu_t * t) / (1 + mu_t * mu_t);
  if (!limits_t) normal = (q.x() + mu_k * k) / (1 + mu_k * mu_k);
  const int sign_t = limits_t ? (q.y() < 0 ? -1 : 1) : 0, sign_k = limits_k ? (q.z() < 0 ? -1 : 1) : 0;
  return {{normal, limits_t ? sign_t * mu_t * normal : q.y(), limits_k ? sign_k * mu_k * normal : q.z()},
          pyramid_region(sign_t, sign_k)};
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
