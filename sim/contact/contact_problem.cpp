#include "sim/contact/contact_problem.h"

#include <algorithm>
#include <cmath>

#include "sim/contact/friction_cone.h"
#include "sim/core/twist.h"

namespace offstage::sim {
namespace {

/// Returns the relative angular velocity due to a unit angular impulse, in the contact's frame [1/(kg m^2)].
Mat3 angular_mobility(const Contact& c, std::span<const ContactBody> bodies) {
  Mat3 axes;
  axes << c.frame.n, c.frame.t, c.frame.k;
  return axes.transpose() * (bodies[c.a].inverse_inertia + bodies[c.b].inverse_inertia) * axes;
}

/// Returns an upper bound of the eigenvalues of the block along t and k.
Real tangential_bound(const Mat3& m) {
  return std::max(m(1, 1), m(2, 2)) + std::abs(m(1, 2));
}

/// Friction of one contact.
struct Friction {
  Tangential force;
  Vec3 moment;
};

/// Returns the friction after a step against the velocities u and w, projected on the limits of friction for
/// the normal impulse `normal` [N s]. K and W: mobility() and angular_mobility().
Friction friction_step(const Contact& c, const Vec3& u, const Vec3& w, Real normal, const Mat3& K,
                       const Mat3& W) {
  const Real k = tangential_bound(K), arm = spin_arm(c);
  Friction next{
      project_on_section(c, Vec3(normal, c.impulse.y() - u.y() / k, c.impulse.z() - u.z() / k), normal)
          .tail<2>(),
      Vec3::Zero()};
  if (arm > 0) {
    // All three components have the same step size, so that friction opposes the velocity.
    const Real step = 1 / std::max(k, arm * arm * W(0, 0));
    const Vec3 wanted =
        Vec3(c.impulse.y(), c.impulse.z(), c.moment.x() / arm) - step * Vec3(u.y(), u.z(), arm * w.x());
    const Vec3 held = shortened(wanted, c.friction_t * normal);
    next = {held.head<2>(), Vec3(arm * held.z(), 0, 0)};
  } else if (c.spinning > 0) {
    const Real limit = c.spinning * normal;
    next.moment.x() = std::clamp(c.moment.x() - w.x() / W(0, 0), -limit, limit);
  }
  if (c.rolling > 0)
    next.moment.tail<2>() =
        shortened(Tangential(c.moment.tail<2>() - w.tail<2>() / tangential_bound(W)), c.rolling * normal);
  return next;
}

/// Returns the natural residual of friction_step(), as a velocity [m/s].
Real turning_violation(const Contact& c, std::span<const ContactBody> bodies) {
  const Mat3 K = mobility(c, bodies), W = angular_mobility(c, bodies);
  const Friction next = friction_step(c, c.relative_velocity(bodies), c.relative_spin(bodies),
                                      std::max(c.impulse.x(), 0.0), K, W);
  const Real radius = std::sqrt(K.trace() / W.trace());
  return std::max((next.force - c.impulse.tail<2>()).norm() * tangential_bound(K),
                  (next.moment - c.moment).norm() * W.trace() * radius);
}

/// Returns the natural residual [m/s]. It is 0 if a step from the impulse p against u, followed by the
/// projection, leads back to p.
Real violation(const Contact& c, std::span<const ContactBody> bodies) {
  if (c.resists_turning()) {
    const Real approach = c.relative_velocity(bodies).x() - c.target;
    const Real K = mobility(c, bodies)(0, 0), p = c.impulse.x();
    return std::max(std::abs(K * (std::max(p - approach / K, 0.0) - p)), turning_violation(c, bodies));
  }
  const Real k = mobility(c, bodies).diagonal().maxCoeff();
  Vec3 u = c.relative_velocity(bodies);
  u.x() -= c.target;
  const Vec3 p = project_on_section(c, c.impulse - u / k, std::max(c.impulse.x(), 0.0));
  return k * (p - c.impulse).cwiseAbs().maxCoeff();
}

/// Solves the friction of a contact with rolling or spinning friction, after the change of its normal
/// impulse. It also applies this change, which the bodies do not contain yet. Returns the greatest change of
/// velocity [m/s].
Real turn_step(Contact& c, const Vec3& before, const Vec3& u, const Mat3& K, std::span<ContactBody> bodies) {
  const Mat3 W = angular_mobility(c, bodies);
  const Friction next = friction_step(c, u, c.relative_spin(bodies), c.impulse.x(), K, W);
  c.impulse.tail<2>() = next.force;
  const Vec3 step = c.impulse - before, turn = next.moment - c.moment;
  c.moment = next.moment;
  apply(c, step, bodies);
  apply_moment(c, turn, bodies);
  return std::max((K * step).cwiseAbs().maxCoeff(),
                  (W * turn).cwiseAbs().maxCoeff() * std::sqrt(K.trace() / W.trace()));
}

}  // namespace

Mat3 mobility(const ContactBody& body, const Vec3& arm) {
  return point_mobility(body.inverse_mass, body.inverse_inertia, arm);
}

Mat3 mobility(const Contact& c, std::span<const ContactBody> bodies) {
  Mat3 axes;
  axes << c.frame.n, c.frame.t, c.frame.k;
  return axes.transpose() * (mobility(bodies[c.a], c.arm_a) + mobility(bodies[c.b], c.arm_b)) * axes;
}

void apply(const Contact& c, const Vec3& impulse, std::span<ContactBody> bodies) {
  const Vec3 p = c.to_world(impulse);
  bodies[c.a].apply(p, c.arm_a);
  bodies[c.b].apply(-p, c.arm_b);
}

void apply_moment(const Contact& c, const Vec3& moment, std::span<ContactBody> bodies) {
  const Vec3 m = c.to_world(moment);
  bodies[c.a].angular_velocity += bodies[c.a].inverse_inertia * m;
  bodies[c.b].angular_velocity -= bodies[c.b].inverse_inertia * m;
}

Real row_speed(const BoundedRow& row, std::span<const ContactBody> bodies) {
  Real u = row.offset;
  for (const auto& [body, on] : {std::pair(row.a, &row.on_a), std::pair(row.b, &row.on_b)})
    if (body != kUnmoved)
      u += on->head<3>().dot(bodies[body].velocity) + on->tail<3>().dot(bodies[body].angular_velocity);
  return u;
}

Real residual(std::span<const ContactBody> bodies, std::span<const Contact> contacts) {
  Real worst = 0;
  for (const Contact& c : contacts) worst = std::max(worst, violation(c, bodies));
  return worst;
}

std::optional<std::size_t> worst_contact(std::span<const ContactBody> bodies,
                                         std::span<const Contact> contacts) {
  std::optional<std::size_t> worst;
  Real greatest = -1;
  for (std::size_t i = 0; i < contacts.size(); ++i)
    if (const Real v = violation(contacts[i], bodies); v > greatest) {
      greatest = v;
      worst = i;
    }
  return worst;
}

Real kinetic_energy(std::span<const ContactBody> bodies) {
  Real energy = 0;
  for (const ContactBody& b : bodies)
    if (b.is_moved())
      energy += b.velocity.squaredNorm() / b.inverse_mass / 2 +
                b.angular_velocity.dot(b.inverse_inertia.inverse() * b.angular_velocity) / 2;
  return energy;
}

Real added_energy(std::span<const ContactBody> before, std::span<const ContactBody> after,
                  std::span<const Contact> contacts) {
  Real energy = 0;
  for (const Contact& c : contacts) {
    energy += c.impulse.dot((c.relative_velocity(before) + c.relative_velocity(after)) / 2 - c.bias);
    if (c.resists_turning()) energy += c.moment.dot(c.relative_spin(before) + c.relative_spin(after)) / 2;
  }
  return energy;
}

uint32_t projected_gauss_seidel(std::span<ContactBody> bodies, std::span<Contact> contacts,
                                uint32_t max_sweeps, Real tolerance) {
  std::vector<Mat3> mobilities(contacts.size());
  for (std::size_t i = 0; i < contacts.size(); ++i) mobilities[i] = mobility(contacts[i], bodies);
  for (uint32_t sweep = 1; sweep <= max_sweeps; ++sweep) {
    Real change = 0;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      Contact& c = contacts[i];
      const Mat3& K = mobilities[i];
      Vec3 u = c.relative_velocity(bodies);
      const Vec3 before = c.impulse;
      c.impulse.x() = std::max(0.0, before.x() - (u.x() - c.target) / K(0, 0));
      // Friction acts against the velocity that remains after the change of the normal impulse. The larger of
      // both diagonal elements makes the step safe.
      u += (c.impulse.x() - before.x()) * K.col(0);
      if (c.resists_turning()) {
        change = std::max(change, turn_step(c, before, u, K, bodies));
        continue;
      }
      const Real k = tangential_bound(K);
      const Vec3 wanted(c.impulse.x(), before.y() - u.y() / k, before.z() - u.z() / k);
      c.impulse = project_on_section(c, wanted, c.impulse.x());
      const Vec3 step = c.impulse - before;
      if (step == Vec3::Zero()) continue;
      apply(c, step, bodies);
      change = std::max(change, (K * step).cwiseAbs().maxCoeff());
    }
    if (change <= tolerance) return sweep;
  }
  return max_sweeps;
}

}  // namespace offstage::sim
