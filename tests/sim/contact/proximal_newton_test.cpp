#include "sim/contact/proximal_newton.h"

#include <cmath>

#include <gtest/gtest.h>

#include "sim/contact/friction_lcp.h"
#include "tests/sim/contact/contact_samples.h"

namespace offstage::sim {
namespace {

/// Returns the largest difference between two solutions, as velocities of the bodies.
Real largest_difference(const ContactSample& x, const ContactSample& y) {
  Real d = 0;
  for (std::size_t i = 0; i < x.bodies.size(); ++i)
    d = std::max({d, (x.bodies[i].velocity - y.bodies[i].velocity).norm(),
                  (x.bodies[i].angular_velocity - y.bodies[i].angular_velocity).norm()});
  return d;
}

// Without friction the velocities are unique, even if the contacts are redundant.
TEST(ProximalNewton, WithoutFrictionAgreesWithPivoting) {
  Dice dice(1);
  int compared = 0;
  for (int round = 0; round < 200; ++round) {
    ContactSample s = random_contacts(dice, 2 + dice.index(6), 1 + dice.index(12), 0, true), t = s;
    const ContactWork newton = *ProximalNewton().solve(s.bodies, s.contacts);
    solve_by_pivoting(t.bodies, t.contacts);
    EXPECT_EQ(newton.fallbacks, 0u);
    if (residual(t.bodies, t.contacts) > 1e-8) continue;
    ++compared;
    ASSERT_LT(largest_difference(s, t), 1e-6) << round;
  }
  EXPECT_GT(compared, 180);
}

// With friction there can be several solutions, so solutions are compared only for few contacts, and where
// both solvers converge to rounding.
TEST(ProximalNewton, WithFrictionAgreesWithPivotingOnFewContacts) {
  Dice dice(2);
  int compared = 0, agreed = 0;
  for (int round = 0; round < 400; ++round) {
    ContactSample s = random_contacts(dice, 3 + dice.index(4), 1 + dice.index(3), 0.5, dice.chance(0.7)),
                  t = s;
    ProximalNewton().solve(s.bodies, s.contacts);
    solve_by_pivoting(t.bodies, t.contacts);
    if (residual(s.bodies, s.contacts) > 1e-8 || residual(t.bodies, t.contacts) > 1e-8) continue;
    ++compared;
    agreed += largest_difference(s, t) < 1e-6;
  }
  EXPECT_GT(compared, 150);
  EXPECT_GE(agreed, compared - compared / 50);
}

// The solution obeys Coulomb's law, and contacts without restitution add no energy.
TEST(ProximalNewton, LeavesNoResidualAndAddsNoEnergy) {
  Dice dice(3);
  int fallbacks = 0;
  for (int round = 0; round < 300; ++round) {
    ContactSample s = random_contacts(dice, 2 + dice.index(10), 1 + dice.index(25), 1, dice.chance(0.7));
    const Real energy = s.kinetic_energy(), speed = s.speed();
    const ContactWork work = *ProximalNewton().solve(s.bodies, s.contacts);
    EXPECT_LT(s.kinetic_energy(), energy * (1 + 1e-9));
    fallbacks += work.fallbacks > 0;
    if (work.fallbacks > 0) continue;
    ASSERT_LT(residual(s.bodies, s.contacts), (work.residual < 1e-8 ? 1e-6 : 1e-3) * speed) << round;
  }
  // Random contacts are harder than those of bodies at rest, so some fall-backs are accepted.
  EXPECT_LT(fallbacks, 100);
}

TEST(ProximalNewton, StacksOfRedundantContactsStopAtOnce) {
  for (const uint32_t height : {1u, 10u, 60u}) {
    ContactSample s = stacked_boxes(height, {0, -0.04, 0}, 0.5);
    const ContactWork work = *ProximalNewton().solve(s.bodies, s.contacts);
    EXPECT_EQ(work.fallbacks, 0u);
    EXPECT_LT(residual(s.bodies, s.contacts), 1e-7);
    Real carried = 0;
    for (std::size_t k = 0; k < 4; ++k) carried += s.contacts[k].impulse.x();
    EXPECT_NEAR(carried, 0.04 * height, 1e-6 * height);
    for (const ContactBody& b : s.bodies) EXPECT_LT(b.velocity.norm() + b.angular_velocity.norm(), 1e-7);
  }
}

TEST(ProximalNewton, ASlidingStackIsSlowedByFriction) {
  ContactSample s = stacked_boxes(1, {1, -0.1, 0}, 0.3);
  ProximalNewton().solve(s.bodies, s.contacts);
  // The impulse along the floor is mu times the one from below. It acts at floor height, but the box does not
  // tip, because the normal impulses shift towards the leading points.
  EXPECT_NEAR(s.bodies[0].velocity.x(), 1 - 0.3 * 0.1, 1e-6);
  EXPECT_NEAR(s.bodies[0].velocity.y(), 0, 1e-6);
  EXPECT_NEAR(s.bodies[0].angular_velocity.norm(), 0, 1e-6);
}

// The solution of one step is the initial guess of the next: at rest, it is confirmed without a
// factorization.
TEST(ProximalNewton, ConfirmsAGuessThatIsTheSolution) {
  ProximalNewton solver;
  ContactSample s = stacked_boxes(10, {0, -0.04, 0}, 0.5);
  EXPECT_GT(solver.solve(s.bodies, s.contacts)->factorizations, 0u);
  ContactSample again = stacked_boxes(10, {0, -0.04, 0}, 0.5);
  for (std::size_t i = 0; i < s.contacts.size(); ++i) {
    again.contacts[i].impulse = s.contacts[i].impulse;
    again.contacts[i].is_guessed = true;
  }
  const ContactWork work = *solver.solve(again.bodies, again.contacts);
  EXPECT_EQ(work.factorizations, 0u);
  EXPECT_LT(largest_difference(s, again), 1e-8);
}

TEST(ProximalNewton, ChangesNothingIfTheBudgetIsTooSmall) {
  Dice dice(4);
  ContactSample s = random_contacts(dice, 8, 20, 0.7, true);
  const ContactSample before = s;
  ProximalNewton solver;
  EXPECT_FALSE(solver.solve(s.bodies, s.contacts, {}, 1).has_value());
  EXPECT_EQ(largest_difference(s, before), 0);
  for (std::size_t i = 0; i < s.contacts.size(); ++i)
    EXPECT_EQ(s.contacts[i].impulse, before.contacts[i].impulse);
  ASSERT_TRUE(solver.solve(s.bodies, s.contacts).has_value());
  EXPECT_GT(solver.cost(), 1);
}

// Contacts with targets, offsets and kinematic bodies, as in resting contact.
TEST(ProximalNewton, MeetsTargetsAndFollowsMovingSurfaces) {
  ContactSample s = stacked_boxes(1, {0, -1, 0}, 10);
  s.bodies[1].velocity = {0.3, 0.2, 0};
  for (Contact& c : s.contacts) {
    c.target = 0.05;
    c.offset = c.to_frame({-0.1, 0, 0});
  }
  ProximalNewton().solve(s.bodies, s.contacts);
  EXPECT_NEAR(s.bodies[0].velocity.y(), 0.25, 1e-8);
  // Sticking contacts have no relative velocity once the offset is included.
  for (const Contact& c : s.contacts) EXPECT_LT(c.relative_velocity(s.bodies).tail<2>().norm(), 1e-7);
}

}  // namespace
}  // namespace offstage::sim
