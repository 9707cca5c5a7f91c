#include "sim/contact/contact_lcp.h"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "sim/contact/proximal_newton.h"
#include "tests/sim/contact/contact_samples.h"

namespace offstage::sim {
namespace {

Real lcp_difference(const ContactSample& x, const ContactSample& y) {
  Real d = 0;
  for (std::size_t i = 0; i < x.bodies.size(); ++i)
    d = std::max({d, (x.bodies[i].velocity - y.bodies[i].velocity).norm(),
                  (x.bodies[i].angular_velocity - y.bodies[i].angular_velocity).norm()});
  return d;
}

// Without friction the velocities are unique, even if the contacts are redundant.
TEST(ContactLcp, WithoutFrictionAgreesWithTheExactSolver) {
  Dice dice(11);
  int solved = 0;
  uint64_t pivots = 0;
  for (int round = 0; round < 200; ++round) {
    ContactSample s = random_contacts(dice, 2 + dice.index(6), 1 + dice.index(12), 0, true), t = s;
    ContactWork work;
    if (!solve_by_lcp(t.bodies, t.contacts, {}, work)) continue;
    ++solved;
    ProximalNewton().solve(s.bodies, s.contacts);
    pivots += work.iterations;
    ASSERT_LT(lcp_difference(s, t), 1e-6) << round;
  }
  EXPECT_GT(solved, 180);
  EXPECT_GT(pivots, 200u);
}

// The normal impulses satisfy the complementarity conditions. The tangential impulses stay within the
// pyramid, and are at its limits where contacts slide.
TEST(ContactLcp, SolutionsObeyTheConditionsOfThePyramid) {
  Dice dice(12);
  int solved = 0, beyond_the_cone = 0;
  for (int round = 0; round < 300; ++round) {
    ContactSample s = random_contacts(dice, 2 + dice.index(6), 1 + dice.index(6), 0.5, dice.chance(0.7));
    const Real energy = s.kinetic_energy(), speed = s.speed();
    ContactWork work;
    if (!solve_by_lcp(s.bodies, s.contacts, {}, work)) continue;
    ++solved;
    EXPECT_LT(s.kinetic_energy(), energy * (1 + 1e-9));
    for (const Contact& c : s.contacts) {
      const Vec3 u = c.relative_velocity(s.bodies), &p = c.impulse;
      ASSERT_GE(p.x(), 0);
      ASSERT_GT(u.x() - c.target, -1e-6 * speed);
      if (p.x() > 1e-6) {
        ASSERT_NEAR(u.x(), c.target, 1e-6 * speed);
      }
      for (const int axis : {1, 2}) {
        const Real limit = (axis == 1 ? c.friction_t : c.friction_k) * p.x();
        ASSERT_LE(std::abs(p[axis]), limit * (1 + 1e-9) + 1e-12);
        if (std::abs(u[axis]) > 1e-6 * speed) {
          ASSERT_NEAR(p[axis], u[axis] > 0 ? -limit : limit, 1e-6 * (1 + limit));
        }
      }
      beyond_the_cone += p.tail<2>().norm() > 1.01 * c.friction_t * p.x();
    }
  }
  EXPECT_GT(solved, 200);
  EXPECT_GT(beyond_the_cone, 10);
}

// Two bodies in a row, joined by a ball joint at their common end; the first one rests on a contact. The
// bounded row is a motor that turns them against each other, of limited strength.
TEST(ContactLcp, JointsHoldAndTheirBoundedRowsKeepTheirBounds) {
  for (const Real strength : {0.01, 100.0}) {
    ContactBody body;
    body.inverse_mass = 0.5;
    body.inverse_inertia = 3 * Mat3::Identity();
    body.velocity = Vec3(0, -1, 0);
    std::array bodies{body, body, ContactBody{}};
    JointRows rows;
    for (int k = 0; k < 3; ++k) {
      JointRow row;
      row.on_a << Vec3::Unit(k), Vec3(0.5, 0, 0).cross(Vec3::Unit(k));
      row.on_b << -Vec3::Unit(k), -Vec3(-0.5, 0, 0).cross(Vec3::Unit(k));
      rows.add(row);
    }
    const std::array constraints{JointConstraint{0, 1, &rows}};
    BoundedRow motor{.a = 0, .b = 1, .target = 2, .lower = -strength, .upper = strength};
    motor.on_a << Vec3::Zero(), Vec3::UnitZ();
    motor.on_b << Vec3::Zero(), -Vec3::UnitZ();
    std::array bounded{motor};
    std::array impulses{Vec6(Vec6::Zero())};
    Contact contact{.a = 0, .b = 2, .frame = contact_frame(Vec3::UnitY())};
    contact.arm_a = Vec3(-0.5, -0.1, 0);
    contact.friction_t = contact.friction_k = 0.4;
    std::array contacts{contact};
    ContactWork work;
    ASSERT_TRUE(solve_by_lcp(bodies, contacts, {constraints, bounded, impulses}, work));
    EXPECT_NEAR(contacts[0].relative_velocity(bodies).x(), 0, 1e-12);
    EXPECT_GT(contacts[0].impulse.x(), 0.1);
    EXPECT_LT((bodies[0].velocity_at({0.5, 0, 0}) - bodies[1].velocity_at({-0.5, 0, 0})).norm(), 1e-12);
    const Real turn = bodies[0].angular_velocity.z() - bodies[1].angular_velocity.z();
    if (strength < 1) {
      EXPECT_NEAR(bounded[0].impulse, strength, 1e-12);
      EXPECT_LT(turn, 2);
    } else {
      EXPECT_NEAR(turn, 2, 1e-12);
      EXPECT_LT(std::abs(bounded[0].impulse), strength);
    }
    // The reported impulses are the impulses that act on the bodies.
    const Vec3 momentum = (bodies[0].velocity + bodies[1].velocity) / 0.5 - Vec3(0, -4, 0);
    EXPECT_LT((momentum - contacts[0].to_world(contacts[0].impulse)).norm(), 1e-12);
    Vec3 second = Vec3::Zero();
    for (int k = 0; k < 3; ++k) second += impulses[0][k] * rows.on_b.col(k).head<3>();
    EXPECT_LT((bodies[1].velocity - Vec3(0, -1, 0) - 0.5 * second).norm(), 1e-12);
  }
}

TEST(ContactLcp, RefusesUnsolvableProblemsAndChangesNothing) {
  ContactSample s = stacked_boxes(20, {0, -0.04, 0}, 0.5);  // 80 contacts
  ASSERT_GT(s.contacts.size(), kMostLcpContacts);
  const ContactSample before = s;
  ContactWork work;
  EXPECT_FALSE(solve_by_lcp(s.bodies, s.contacts, {}, work));
  EXPECT_EQ(work.fallbacks, 1u);
  EXPECT_EQ(lcp_difference(s, before), 0);
  s = stacked_boxes(2, {0, -0.04, 0}, 0.5);
  s.contacts[0].rolling = 0.01;
  EXPECT_FALSE(solve_by_lcp(s.bodies, s.contacts, {}, work));
  EXPECT_EQ(work.fallbacks, 2u);
  EXPECT_EQ(work.solves, 2u);
}

}  // namespace
}  // namespace offstage::sim
