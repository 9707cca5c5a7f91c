#include "sim/contact/jointed_sweeps.h"

#include <array>

#include <gtest/gtest.h>

#include "sim/contact/collision.h"

namespace offstage::sim {
namespace {

/// Two rods in a row along x, joined by a ball joint. The far end of the second rod hits the ground.
struct Pair {
  std::array<ContactBody, 3> bodies;
  std::array<JointRows, 1> rows;
  std::array<JointConstraint, 1> constraints;
  std::array<Vec6, 1> impulses{Vec6::Zero()};
  std::array<Contact, 1> contacts;

  Pair() {
    for (int i = 0; i < 2; ++i) {
      bodies[static_cast<std::size_t>(i)] = {.inverse_mass = 0.5 + i,
                                             .inverse_inertia = Vec3(30, 6, 6).asDiagonal(),
                                             .velocity = {0.3, -2, 0.1},
                                             .angular_velocity = Vec3::Zero()};
    }
    for (Eigen::Index k = 0; k < 3; ++k) {
      JointRow row{Vec6::Zero(), Vec6::Zero()};
      row.on_a << Vec3::Unit(k), Vec3(0.5, 0, 0).cross(Vec3::Unit(k));
      row.on_b << -Vec3::Unit(k), -Vec3(-0.5, 0, 0).cross(Vec3::Unit(k));
      rows[0].add(row);
    }
    constraints[0] = {0, 1, &rows[0]};
    contacts[0].a = 1;
    contacts[0].b = 2;
    contacts[0].frame = contact_frame(Vec3::UnitY());
    contacts[0].arm_a = {0.5, 0, 0};
    contacts[0].friction_t = contacts[0].friction_k = 0.4;
  }

  JointProblem joints() { return {constraints, {}, impulses}; }
  Real kinetic_energy() const {
    Real sum = 0;
    for (const ContactBody& b : bodies)
      if (b.is_moved())
        sum += (b.velocity.squaredNorm() / b.inverse_mass +
                b.angular_velocity.dot(b.inverse_inertia.inverse() * b.angular_velocity)) /
               2;
    return sum;
  }
  Real apart() const {
    return (bodies[0].velocity_at({0.5, 0, 0}) - bodies[1].velocity_at({-0.5, 0, 0})).norm();
  }
};

TEST(JointedSweeps, ConvergeToTheCollisionOfTheExactSolver) {
  Pair exact, swept;
  const std::array<Real, 1> plastic{0};
  EXPECT_EQ(collide(exact.bodies, exact.contacts, plastic, ImpactLaw::simultaneous, exact.joints()).fallbacks,
            0u);
  jointed_gauss_seidel(swept.bodies, swept.contacts, swept.joints(), 1000, 1e-14);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_LT((swept.bodies[i].velocity - exact.bodies[i].velocity).norm(),
              1e-7);  // the exact solution has a residual of 1e-6 of the speeds at most
    EXPECT_LT((swept.bodies[i].angular_velocity - exact.bodies[i].angular_velocity).norm(), 1e-6);
  }
}

TEST(JointedSweeps, NeverAddEnergyAndKeepTheJoints) {
  Real before = Pair().kinetic_energy();
  for (uint32_t sweeps = 1; sweeps < 20; ++sweeps) {
    Pair pair;
    jointed_gauss_seidel(pair.bodies, pair.contacts, pair.joints(), sweeps, 0);
    EXPECT_LE(pair.kinetic_energy(), before) << sweeps;
    EXPECT_LT(pair.apart(), 1e-12) << sweeps;
    before = pair.kinetic_energy();
  }
}

}  // namespace
}  // namespace offstage::sim
