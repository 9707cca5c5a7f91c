#pragma once
/// Contact problems for tests of the solvers.

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/LU>

#include "sim/contact/contact_problem.h"
#include "tests/convex_samples.h"

namespace offstage::sim {

struct ContactSample {
  std::vector<ContactBody> bodies;
  std::vector<Contact> contacts;
  std::vector<Vec3> positions;  ///< centres of mass; set by random_contacts

  Vec3 momentum() const {
    Vec3 p = Vec3::Zero();
    for (const ContactBody& b : bodies)
      if (b.is_moved()) p += b.velocity / b.inverse_mass;
    return p;
  }
  /// Returns the angular momentum of all bodies about the origin; `positions` must be set [kg m^2/s].
  Vec3 angular_momentum() const {
    Vec3 h = Vec3::Zero();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const ContactBody& b = bodies[i];
      if (b.is_moved())
        h += positions[i].cross(b.velocity) / b.inverse_mass +
             b.inverse_inertia.inverse() * b.angular_velocity;
    }
    return h;
  }
  /// Returns the greatest component of the relative velocities at the contacts [m/s].
  Real speed() const {
    Real s = 0;
    for (const Contact& c : contacts) s = std::max(s, c.relative_velocity(bodies).cwiseAbs().maxCoeff());
    return s;
  }
  Real kinetic_energy() const {
    Real e = 0;
    for (const ContactBody& b : bodies) {
      if (!b.is_moved()) continue;
      e += b.velocity.squaredNorm() / b.inverse_mass / 2;
      if (!b.inverse_inertia.isZero())
        e += b.angular_velocity.dot(b.inverse_inertia.inverse() * b.angular_velocity) / 2;
    }
    return e;
  }
};

inline ContactBody box_body(Real mass, const Vec3& size) {
  const Vec3 s = size.cwiseAbs2();
  const Vec3 inertia = mass / 12 * Vec3(s.y() + s.z(), s.z() + s.x(), s.x() + s.y());
  return {.inverse_mass = 1 / mass, .inverse_inertia = inertia.cwiseInverse().asDiagonal()};
}

inline ContactBody sphere_body(Real mass, Real radius) {
  return {.inverse_mass = 1 / mass, .inverse_inertia = Mat3::Identity() / (0.4 * mass * radius * radius)};
}

inline Contact contact_between(uint32_t a, uint32_t b, const Vec3& normal, const Vec3& arm_a,
                               const Vec3& arm_b, Real friction) {
  Contact c{.a = a, .b = b, .frame = contact_frame(normal), .arm_a = arm_a, .arm_b = arm_b};
  c.friction_t = c.friction_k = friction;
  return c;
}

/// Returns random bodies with contacts at random places; the last body is static. All target velocities are
/// zero, so a solution always exists.
inline ContactSample random_contacts(Dice& dice, uint32_t bodies, uint32_t contacts, Real most_friction,
                                     bool isotropic) {
  ContactSample s;
  for (uint32_t i = 0; i < bodies; ++i) {
    ContactBody b = box_body(dice.uniform(0.5, 3), Vec3::Constant(1) + 0.7 * dice.in_cube());
    const Mat3 turn = dice.rotation().toRotationMatrix();
    b.inverse_inertia = turn * b.inverse_inertia * turn.transpose();
    b.velocity = dice.in_cube();
    b.angular_velocity = dice.in_cube();
    s.bodies.push_back(i + 1 < bodies ? b : ContactBody{});
    s.positions.push_back(dice.in_cube());
  }
  for (uint32_t i = 0; i < contacts; ++i) {
    const uint32_t a = dice.index(bodies - 1), b = (a + 1 + dice.index(bodies - 1)) % bodies;
    const Vec3 point = 1.5 * dice.in_cube();
    Contact c = contact_between(a, b, dice.direction(), point - s.positions[a], point - s.positions[b], 0);
    c.friction_t = dice.chance(0.1) ? 0 : dice.uniform(0, most_friction);
    c.friction_k = isotropic ? c.friction_t : dice.uniform(0, most_friction);
    s.contacts.push_back(c);
  }
  return s;
}

/// Returns a stack of unit cubes of 1 kg on the ground (the last body), all moving at `velocity`.
inline ContactSample stacked_boxes(uint32_t boxes, const Vec3& velocity, Real friction) {
  ContactSample s;
  for (uint32_t i = 0; i < boxes; ++i) {
    s.bodies.push_back(box_body(1, Vec3::Ones()));
    s.bodies.back().velocity = velocity;
    for (const auto& [x, z] : {std::pair(-0.5, -0.5), {0.5, -0.5}, {-0.5, 0.5}, {0.5, 0.5}})
      s.contacts.push_back(contact_between(i, i == 0 ? boxes : i - 1, Vec3::UnitY(), Vec3(x, -0.5, z),
                                           Vec3(x, i == 0 ? 0 : 0.5, z), friction));
  }
  s.bodies.emplace_back();
  return s;
}

}  // namespace offstage::sim
