/// Rolling and spinning friction in the exact solver.

#include <algorithm>
#include <cmath>

#include "sim/contact/proximal_newton.h"

namespace offstage::sim {
namespace {

/// Penalty of rolling and spinning friction times the angular mobility; it equals this product for contacts.
constexpr Real kTurningStiffness = 1e5;

using Vec4 = Eigen::Matrix<Real, 4, 1>;
using Mat4 = Eigen::Matrix<Real, 4, 4>;

/// Projection on the round cone |(q_t, q_k, q_s)| <= mu q_n.
struct RoundProjection {
  Vec4 point;
  ConeRegion region;
};
RoundProjection project_on_round_cone(Real mu, const Vec4& q) {
  const Real length = q.tail<3>().norm();
  if (q.x() >= 0 && length <= mu * q.x()) return {q, ConeRegion::inside};
  if (mu * length <= -q.x()) return {Vec4::Zero(), ConeRegion::apex};
  Vec4 p;
  p.x() = (q.x() + mu * length) / (1 + mu * mu);
  p.tail<3>() = mu * p.x() / length * q.tail<3>();
  return {p, ConeRegion::surface};
}

/// Returns the derivative of the projection on the round cone at q.
Mat4 round_cone_derivative(Real mu, const Vec4& q, ConeRegion region, Real normal) {
  if (region == ConeRegion::apex) return Mat4::Zero();
  if (region == ConeRegion::inside) return Mat4::Identity();
  const Real length = q.tail<3>().norm();
  Vec4 out = Vec4::Zero();
  out.tail<3>() = q.tail<3>() / length;
  const Vec4 along = Vec4(1, 0, 0, 0) + mu * out;
  Mat4 D = along * along.transpose() / (1 + mu * mu);
  Mat4 across = -out * out.transpose();
  across.diagonal().tail<3>().array() += 1;
  return D + mu * normal / length * across;
}

/// Returns the derivative of shortened(q, limit) by q.
Eigen::Matrix<Real, 2, 2> shortened_derivative(const Tangential& q, Real limit) {
  const Real length = q.norm();
  if (length <= limit) return Eigen::Matrix<Real, 2, 2>::Identity();
  const Tangential out = q / length, across(-out.y(), out.x());
  return limit / length * across * across.transpose();
}

Vec4 joined(const Vec3& point, Real spin) {
  return {point.x(), point.y(), point.z(), spin};
}

}  // namespace

void ProximalNewton::set_turning(std::span<const ContactBody> bodies, const Contact& c, Point& p) {
  p.turning = static_cast<uint32_t>(turnings_.size());
  const Real angular = (bodies[c.a].inverse_inertia + bodies[c.b].inverse_inertia).trace() / 3;
  Turning t{.arm = spin_arm(c), .rho = kTurningStiffness / angular, .mobility = angular};
  if (p.a == kNone) t.fixed += c.to_frame(bodies[c.a].angular_velocity);
  if (p.b == kNone) t.fixed -= c.to_frame(bodies[c.b].angular_velocity);
  t.radius = std::sqrt((bodies[c.a].inverse_mass + bodies[c.b].inverse_mass) / angular);
  t.spin_limit = c.spinning * p.multiplier.x();
  t.roll_limit = c.rolling * p.multiplier.x();
  turnings_.push_back(t);
}

/// Returns (s w_n, w_t, w_k), where w is the relative angular velocity of the bodies in the contact's frame.
/// The scale s is 1 if spinning friction has a limit of its own.
Vec3 ProximalNewton::turning_speed(const Contact& c, const Point& p) const {
  const Turning& t = turnings_[p.turning];
  Vec3 w = Vec3::Zero();
  if (p.a != kNone) w += velocity_[p.a].tail<3>();
  if (p.b != kNone) w -= velocity_[p.b].tail<3>();
  Vec3 speed = c.to_frame(w) + t.fixed;
  speed.x() *= t.spin_scale();
  return speed;
}

void ProximalNewton::evaluate_turning(const Contact& c, Point& p, const Vec3& u) {
  Turning& t = turnings_[p.turning];
  const Vec3 w = turning_speed(c, p), q = p.multiplier - p.rho * u;
  t.shifted = t.multiplier - t.rho * w;
  p.shifted = q;
  if (t.arm > 0) {
    t.shifted.x() = t.multiplier.x() - p.rho * w.x();
    const RoundProjection projection = project_on_round_cone(c.friction_t, joined(q, t.shifted.x()));
    p.impulse = projection.point.head<3>();
    p.region = projection.region;
    t.impulse.x() = projection.point.w();
    merit_.add(projection.point.squaredNorm() / (2 * p.rho));
  } else {
    const ConeProjection projection = project_on_cone(c, q);
    p.impulse = projection.point;
    p.region = projection.region;
    t.impulse.x() = std::clamp(t.shifted.x(), -t.spin_limit, t.spin_limit);
    merit_.add(p.impulse.squaredNorm() / (2 * p.rho));
    merit_.add(t.impulse.x() * (2 * t.shifted.x() - t.impulse.x()) / (2 * t.rho));
  }
  const Tangential shifted = t.shifted.tail<2>(), roll = shortened(shifted, t.roll_limit);
  t.impulse.tail<2>() = roll;
  // This is half of |q|^2 - |q - p|^2, whose derivative is the projection p of q on a convex set.
  merit_.add(roll.dot(2 * shifted - roll) / (2 * t.rho));
}

/// Returns the angular impulse on body a, in world axes [N m s].
Vec3 ProximalNewton::turning_impulse(const Contact& c, const Point& p) const {
  const Turning& t = turnings_[p.turning];
  return c.to_world({t.spin_scale() * t.impulse.x(), t.impulse.y(), t.impulse.z()});
}

void ProximalNewton::assemble_turning(const Contact& c, const Point& p) {
  const Turning& t = turnings_[p.turning];
  // The rows are n, t and k of the point, spinning, and rolling about t and k.
  Mat6 W = Mat6::Zero();
  if (t.arm > 0) {
    W.topLeftCorner<4, 4>() = p.rho * round_cone_derivative(c.friction_t, joined(p.shifted, t.shifted.x()),
                                                            p.region, p.impulse.x());
  } else {
    W.topLeftCorner<3, 3>() = p.rho * cone_derivative(c, p.shifted, {p.impulse, p.region});
    if (std::abs(t.shifted.x()) < t.spin_limit) W(3, 3) = t.rho;
  }
  W.bottomRightCorner<2, 2>() = t.rho * shortened_derivative(t.shifted.tail<2>(), t.roll_limit);
  const auto rows = [&](const Vec3& arm) {
    Mat6 J;
    J.setZero();
    J.col(0) << c.frame.n, arm.cross(c.frame.n);
    J.col(1) << c.frame.t, arm.cross(c.frame.t);
    J.col(2) << c.frame.k, arm.cross(c.frame.k);
    J.col(3).tail<3>() = t.spin_scale() * c.frame.n;
    J.col(4).tail<3>() = c.frame.t;
    J.col(5).tail<3>() = c.frame.k;
    return J;
  };
  const Mat6 a = rows(c.arm_a), b = rows(c.arm_b);
  if (p.a != kNone) diagonal_[p.a] += a * W * a.transpose();
  if (p.b != kNone) diagonal_[p.b] += b * W * b.transpose();
  if (p.pair == kNone) return;
  off_[p.pair] -= p.a < p.b ? a * W * b.transpose() : b * W * a.transpose();
}

Real ProximalNewton::turning_lift(const Contact& c, const Point& p, const Vec3& u) const {
  if (p.turning == kNone || turnings_[p.turning].arm == 0) return cone_lift(c, u);
  return c.friction_t * Vec3(u.y(), u.z(), turning_speed(c, p).x()).norm();
}

/// Whether an open contact has no impulse at the relative velocity u, which includes the lift.
bool ProximalNewton::stays_open(const Contact& c, const Point& p, const Vec3& u) const {
  if (p.turning == kNone || turnings_[p.turning].arm == 0)
    return project_on_cone(c, -p.rho * u).region == ConeRegion::apex;
  const Vec4 q = -p.rho * joined(u, turning_speed(c, p).x());
  return project_on_round_cone(c.friction_t, q).region == ConeRegion::apex;
}

/// Updates rolling and spinning friction of a point. The multiplier of the point must be updated before.
void ProximalNewton::update_turning(const Contact& c, Point& p, Change& change) {
  Turning& t = turnings_[p.turning];
  const Vec3 rho(t.arm > 0 ? p.rho : t.rho, t.rho, t.rho);
  const Vec3 radius(t.arm > 0 ? 1 : t.radius, t.radius, t.radius);
  const Vec3 lacking = (t.impulse - t.multiplier).cwiseQuotient(rho).cwiseProduct(radius);
  change.multipliers = std::max(change.multipliers, lacking.cwiseAbs().maxCoeff());
  t.multiplier = t.impulse;
  const Real before = t.spin_limit + t.roll_limit;
  t.spin_limit = c.spinning * p.multiplier.x();
  t.roll_limit = c.rolling * p.multiplier.x();
  // If a limit is reached, the change of the limits counts as a change of g. It is converted to the greatest
  // velocity that it can cause.
  Vec3 within = t.multiplier;
  within.tail<2>() = shortened(Tangential(within.tail<2>()), t.roll_limit);
  if (t.arm == 0) within.x() = std::clamp(within.x(), -t.spin_limit, t.spin_limit);
  const bool is_reached = t.shifted.tail<2>().norm() > t.roll_limit ||
                          (t.arm == 0 && std::abs(t.shifted.x()) > t.spin_limit) || within != t.multiplier;
  if (!is_reached) return;
  const Real limits = t.spin_limit + t.roll_limit;
  change.lifts = std::max(change.lifts, std::abs(limits - before) * t.mobility * t.radius);
}

void ProximalNewton::store_moments(std::span<Contact> contacts) const {
  if (turnings_.empty()) return;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (points_[i].turning == kNone) continue;
    const Turning& t = turnings_[points_[i].turning];
    contacts[i].moment = {t.spin_scale() * t.multiplier.x(), t.multiplier.y(), t.multiplier.z()};
  }
}

}  // namespace offstage::sim
