#include "sim/contact/contact_problem.h"

#include <algorithm>
#include <cmath>

#include "sim/contact/friction_limit.h"

namespace offstage::sim {
namespace {

Mat3 cross_of(const Vec3& r) {
  Mat3 m;
  m << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
  return m;
}

/// Natural residual: p is the solution if a step against u and a projection return p.
Real violation(const Contact& c, std::span<const ContactBody> bodies) {
  const Real k = mobility(c, bodies).diagonal().maxCoeff();
  Vec3 u = c.relative_velocity(bodies);
  u.x() -= c.target;
  const Vec3 p = projected(c, c.impulse - u / k, std::max(c.impulse.x(), 0.0));
  return k * (p - c.impulse).cwiseAbs().maxCoeff();
}

}  // namespace

Mat3 mobility(const ContactBody& body, const Vec3& arm) {
  const Mat3 x = cross_of(arm);
  return body.inverse_mass * Mat3::Identity() - x * body.inverse_inertia * x;
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

Real added_energy(std::span<const ContactBody> before, std::span<const ContactBody> after,
                  std::span<const Contact> contacts) {
  Real energy = 0;
  for (const Contact& c : contacts)
    energy += c.impulse.dot((c.relative_velocity(before) + c.relative_velocity(after)) / 2 - c.bias);
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
      // Friction against the velocity that remains after the change of the normal impulse. The larger of both
      // diagonal elements makes the step safe.
      u += (c.impulse.x() - before.x()) * K.col(0);
      const Real k = std::max(K(1, 1), K(2, 2)) + std::abs(K(1, 2));
      const Vec3 wanted(c.impulse.x(), before.y() - u.y() / k, before.z() - u.z() / k);
      c.impulse = projected(c, wanted, c.impulse.x());
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
