#include "sim/contact/collision.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "tests/sim/contact/contact_samples.h"

namespace offstage::sim {
namespace {

/// Two bodies of 2 and 3 kg whose centres lie on the contact normal, so K is diagonal.
struct SpherePair {
  static constexpr Real m12 = 2.0 * 3 / (2 + 3);
  ContactSample sample;

  explicit SpherePair(bool turn) {
    sample.bodies = {sphere_body(2, 0.5), sphere_body(3, 0.25)};
    if (!turn)
      for (ContactBody& b : sample.bodies) b.inverse_inertia.setZero();
    sample.contacts = {
        contact_between(0, 1, Vec3(2, -1, 2) / 3, -0.5 * Vec3(2, -1, 2) / 3, 0.25 * Vec3(2, -1, 2) / 3, 0)};
  }
  Mat3 K() const { return mobility(sample.contacts[0], sample.bodies); }
};

// P5. For solid spheres that may turn, the tangential effective mass is 2/7 m12.
TEST(Collision, ObliqueImpactSticksOrSlidesOnEitherSideOfTheCriticalFriction) {
  const Vec3 u(-3, 1.2, -1.6);
  constexpr Real e = 0.4, kAcross = 2.0;
  for (const bool turn : {false, true}) {
    const Real tangential = SpherePair::m12 * (turn ? 2.0 / 7 : 1), normal = (1 + e) * SpherePair::m12 * 3;
    const Real critical = tangential * kAcross / normal;
    const Mat3 K = SpherePair(turn).K();
    for (const Real ratio : {0.0, 0.5, 0.999, 1.001, 3.0}) {
      const Vec3 p = collision_impulse(K, u, e, ratio * critical, ratio * critical);
      const Real across = std::min(ratio, 1.0) * tangential * kAcross;
      EXPECT_LT((p - Vec3(normal, -across * 0.6, across * 0.8)).norm(), 1e-12) << ratio;
    }
  }
}

TEST(Collision, AxesWithTheirOwnCoefficientsStickOrSlideByThemselves) {
  const Vec3 u(-3, 1.2, -1.6);
  const Real normal = 1.5 * SpherePair::m12 * 3, t = SpherePair::m12 * 1.2, k = SpherePair::m12 * 1.6;
  const Mat3 K = SpherePair(false).K();
  for (const auto& [mu_t, mu_k] : {std::pair(0.1, 0.2), {0.1, 2.0}, {2.0, 0.1}, {2.0, 3.0}}) {
    const Vec3 p = collision_impulse(K, u, 0.5, mu_t, mu_k);
    const Vec3 expected(normal, -std::min(t, mu_t * normal), std::min(k, mu_k * normal));
    EXPECT_LT((p - expected).norm(), 1e-12);
  }
}

/// Returns the violation of Coulomb's law after the impact: the residual of the contact problem whose target
/// is the normal velocity.
Real violation(ContactSample s, const Vec3& p) {
  apply(s.contacts[0], p, s.bodies);
  s.contacts[0].impulse = p;
  s.contacts[0].target = s.contacts[0].relative_velocity(s.bodies).x();
  return residual(s.bodies, s.contacts);
}

// Random bodies, so all components of K are non-zero. Friction must fit the sliding velocity that remains.
// The restitution must be the given one or, if that would add energy, the largest possible one.
TEST(Collision, OneContactObeysCoulombAndKeepsTheEnergy) {
  for (const bool isotropic : {true, false}) {
    Dice dice(isotropic ? 1 : 2);
    int reduced = 0;
    for (int k = 0; k < 5000; ++k) {
      ContactSample s = random_contacts(dice, 2 + dice.index(2), 1, 2, isotropic);
      Contact& c = s.contacts[0];
      const Vec3 u = c.relative_velocity(s.bodies);
      const Mat3 K = mobility(c, s.bodies);
      const Real e = dice.uniform();
      const Vec3 p = collision_impulse(K, u, e, c.friction_t, c.friction_k);
      if (u.x() >= 0) {
        ASSERT_EQ(p, Vec3::Zero());
        continue;
      }
      ASSERT_GT(p.x(), 0);
      ASSERT_LT(violation(s, p), 1e-11);
      const Real energy = p.dot(u + K * p / 2), bounce = (u + K * p).x();
      ASSERT_LT(energy, 2e-13 * p.norm() * u.norm());
      if (std::abs(bounce + e * u.x()) < 1e-12) continue;
      ++reduced;
      ASSERT_GE(bounce, -1e-12);
      ASSERT_LT(bounce, -e * u.x());
      ASSERT_GT(energy, -1e-12 * (1 + p.norm() * u.norm()));
    }
    EXPECT_GT(reduced, 20);
  }
}

TEST(Collision, ClustersKeepMomentumAndNeverGainEnergy) {
  Dice dice(3);
  for (int k = 0; k < 400; ++k) {
    const uint32_t bodies = 3 + dice.index(4), contacts = 1 + dice.index(8);
    ContactSample s = random_contacts(dice, bodies, contacts, 1, dice.chance(0.7));
    s.bodies.back() = sphere_body(1, 1);
    std::vector<Real> e;
    for (uint32_t i = 0; i < contacts; ++i) e.push_back(dice.chance(0.3) ? 1 : dice.uniform());
    const ImpactLaw law = dice.chance(0.5) ? ImpactLaw::simultaneous : ImpactLaw::sequential;
    const Vec3 momentum = s.momentum(), angular = s.angular_momentum();
    const Real energy = s.kinetic_energy();
    const ContactWork work = collide(s.bodies, s.contacts, e, law);
    ASSERT_LT((s.momentum() - momentum).norm(), 1e-11);
    ASSERT_LT((s.angular_momentum() - angular).norm(), 1e-11);
    ASSERT_LT(s.kinetic_energy(), energy + 1e-10);
    for (const Contact& c : s.contacts) {
      ASSERT_GE(c.impulse.x(), 0);
      ASSERT_GT(c.relative_velocity(s.bodies).x(), -1e-8) << work.fallbacks;
    }
  }
}

/// Returns five balls in a row along x, of which the first `moving` balls have 1 m/s.
ContactSample cradle(int moving) {
  ContactSample s;
  for (int i = 0; i < 5; ++i) {
    s.bodies.push_back(sphere_body(0.3, 0.05));
    if (i < moving) s.bodies.back().velocity = Vec3::UnitX();
    const auto k = static_cast<uint32_t>(i);
    if (i > 0)
      s.contacts.push_back(contact_between(k, k - 1, Vec3::UnitX(), {-0.05, 0, 0}, {0.05, 0, 0}, 0.2));
  }
  return s;
}

TEST(Collision, NewtonsCradleEjectsAsManyBallsAsArrive) {
  const std::vector<Real> e(4, 1);
  for (int moving = 1; moving < 5; ++moving) {
    ContactSample s = cradle(moving);
    collide(s.bodies, s.contacts, e, ImpactLaw::sequential);
    for (int i = 0; i < 5; ++i)
      EXPECT_NEAR(s.bodies[static_cast<std::size_t>(i)].velocity.x(), i < 5 - moving ? 0 : 1, 1e-9);
  }
}

// All contacts are resolved together, and contacts at rest may not close: the row of four balls leaves at one
// speed.
TEST(Collision, SimultaneousCradleMovesAsOne) {
  ContactSample s = cradle(1);
  const ContactWork work = collide(s.bodies, s.contacts, std::vector<Real>(4, 1), ImpactLaw::simultaneous);
  EXPECT_EQ(work.fallbacks, 0u);
  // Restitution and momentum: v0 = v - 1, v0 + 4 v = 1
  EXPECT_NEAR(s.bodies[0].velocity.x(), -0.6, 1e-12);
  for (std::size_t i = 1; i < 5; ++i) EXPECT_NEAR(s.bodies[i].velocity.x(), 0.4, 1e-12);
}

// Contacts with equal approach speeds are resolved together, so their order in the list has no effect.
TEST(Collision, ASequenceDoesNotDependOnTheOrderOfTheList) {
  // One ball hits two that touch each other, on either side of its path.
  const auto broken = [](bool reversed) {
    ContactSample s;
    const Vec3 right = Vec3(std::sqrt(3), 1, 0) / 2, left = Vec3(std::sqrt(3), -1, 0) / 2;
    s.bodies = {sphere_body(1, 0.1), sphere_body(1, 0.1), sphere_body(1, 0.1)};
    s.bodies[0].velocity = Vec3(4, 0, 0);
    s.contacts = {contact_between(1, 0, right, -0.1 * right, 0.1 * right, 0.3),
                  contact_between(2, 0, left, -0.1 * left, 0.1 * left, 0.3),
                  contact_between(1, 2, Vec3::UnitY(), -0.1 * Vec3::UnitY(), 0.1 * Vec3::UnitY(), 0.3)};
    if (reversed) std::reverse(s.contacts.begin(), s.contacts.end());
    collide(s.bodies, s.contacts, std::vector<Real>(3, 0.9), ImpactLaw::sequential);
    return s.bodies;
  };
  const std::vector<ContactBody> a = broken(false), b = broken(true);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_LT((a[i].velocity - b[i].velocity).norm(), 1e-9) << i;
  EXPECT_NEAR(a[1].velocity.x(), a[2].velocity.x(), 1e-9);
  EXPECT_NEAR(a[1].velocity.y(), -a[2].velocity.y(), 1e-9);
}

// A body between two faces cannot satisfy the restitution of both: it stops, and no energy is added.
TEST(Collision, TargetsThatContradictEachOtherEndInAPlasticImpact) {
  ContactSample s;
  s.bodies = {sphere_body(1, 0.1), ContactBody{}};
  s.bodies[0].velocity = Vec3(-3, 0.5, 0);
  s.contacts = {contact_between(0, 1, Vec3::UnitX(), -0.1 * Vec3::UnitX(), Vec3::Zero(), 0.3),
                contact_between(0, 1, -Vec3::UnitX(), 0.1 * Vec3::UnitX(), Vec3::Zero(), 0.3)};
  const Real energy = s.kinetic_energy();
  const ContactWork work = collide(s.bodies, s.contacts, std::vector<Real>(2, 0.5), ImpactLaw::simultaneous);
  EXPECT_EQ(work.fallbacks, 1u);
  EXPECT_NEAR(s.bodies[0].velocity.x(), 0, 1e-6);
  EXPECT_LT(s.kinetic_energy(), energy);
}

// A box that falls flat rebounds flat, although four contacts are one more than its three affected degrees of
// freedom need.
TEST(Collision, BoxFallsFlatAndBouncesFlat) {
  ContactSample s = stacked_boxes(1, Vec3(0, -2, 0), 0.5);
  const ContactWork work = collide(s.bodies, s.contacts, std::vector<Real>(4, 0.5), ImpactLaw::simultaneous);
  EXPECT_EQ(work.fallbacks, 0u);
  EXPECT_LT((s.bodies[0].velocity - Vec3(0, 1, 0)).norm(), 1e-12);
  EXPECT_LT(s.bodies[0].angular_velocity.norm(), 1e-12);
}

TEST(Collision, AnEndlessSequenceIsCutOff) {
  ContactSample s = stacked_boxes(5, Vec3(0.3, -2, 0.1), 0.5);
  const ContactWork work = collide(s.bodies, s.contacts, std::vector<Real>(20, 0.9), ImpactLaw::sequential);
  EXPECT_LE(work.iterations, 200u * 20 + 20'000);
  for (const Contact& c : s.contacts) EXPECT_GT(c.relative_velocity(s.bodies).x(), -1e-8);
  EXPECT_TRUE(s.bodies[4].velocity.allFinite());
}

}  // namespace
}  // namespace offstage::sim
