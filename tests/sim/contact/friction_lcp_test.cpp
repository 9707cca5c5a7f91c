#include "sim/contact/friction_lcp.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "sim/contact/friction_pivoting.h"
#include "sim/linear/updated_qr.h"
#include "tests/sim/contact/contact_samples.h"

namespace offstage::sim {
namespace {

/// Checks the conditions one by one, without code of the solver or the problem: bounds, complementarity, and
/// maximal dissipation (no admissible friction impulse takes out more power).
void expect_law(const ContactSample& s, Real tolerance) {
  for (const Contact& c : s.contacts) {
    const Vec3 u = c.relative_velocity(s.bodies), p = c.impulse;
    ASSERT_GE(p.x(), 0);
    ASSERT_GE(u.x(), c.target - tolerance);
    ASSERT_LE(p.x() * (u.x() - c.target), tolerance * (1 + p.x()));
    const Real t = c.friction_t * p.x(), k = c.friction_k * p.x();
    const Real most = c.is_isotropic() ? t * u.tail<2>().norm() : t * std::abs(u.y()) + k * std::abs(u.z());
    if (c.is_isotropic()) {
      ASSERT_LE(p.tail<2>().norm(), t + tolerance);
    } else {
      ASSERT_LE(std::abs(p.y()), t + tolerance);
      ASSERT_LE(std::abs(p.z()), k + tolerance);
    }
    ASSERT_NEAR(-p.tail<2>().dot(u.tail<2>()), most, tolerance * (1 + p.norm()));
  }
}

TEST(FrictionLcp, RandomContactsDissipateTheMostInTheirBounds) {
  Dice dice(5);
  ContactWork work;
  int trials = 0;
  for (const bool isotropic : {true, false})
    for (const auto& [bodies, contacts] : {std::pair(2u, 1u), {2u, 3u}, {3u, 4u}, {5u, 10u}, {12u, 24u}})
      for (int k = 0; k < 60; ++k, ++trials) {
        ContactSample s = random_contacts(dice, bodies, contacts, 0.8, isotropic);
        const ContactSample before = s;
        const ContactWork w = solve_by_pivoting(s.bodies, s.contacts);
        work.add(w);
        ASSERT_LT(w.residual, 1e-9);
        expect_law(s, 1e-8);
        for (const Contact& c : s.contacts) {  // the impulses are those that were applied to the bodies
          ContactSample again = before;
          for (const Contact& d : s.contacts) apply(d, d.impulse, again.bodies);
          ASSERT_LT((again.bodies[c.a].velocity - s.bodies[c.a].velocity).norm(), 1e-12);
        }
      }
  EXPECT_EQ(trials, 600);
  EXPECT_LT(work.fallbacks, 12u);
}

// Falling, at rest or sliding diagonally: the rows are dependent, and which box slides on which is not known
// in advance.
TEST(FrictionLcp, StacksOfBoxesAreSolved) {
  for (const uint32_t boxes : {1u, 2u, 5u, 10u, 15u})
    for (const Vec3& v : {Vec3(0, -1, 0), Vec3(0.4, -1, 0.1), Vec3(2, -1, 0.6)}) {
      ContactSample s = stacked_boxes(boxes, v, 0.5);
      const ContactWork work = solve_by_pivoting(s.bodies, s.contacts);
      EXPECT_EQ(work.fallbacks, 0u) << boxes << " at " << v.x();
      EXPECT_LT(work.residual, 1e-9);
      expect_law(s, 1e-8);
    }
}

// The friction impulse of a box that slides without tipping is mu m v_n, opposite to the sliding direction,
// which is along none of the axes.
TEST(FrictionLcp, FrictionOpposesSlidingInEveryDirection) {
  for (int k = 0; k < 24; ++k) {
    const Real angle = 0.1 + 2 * 3.14159265358979 * k / 24;
    const Vec3 along(std::cos(angle), 0, std::sin(angle));
    ContactSample s = stacked_boxes(1, 3 * along - 0.5 * Vec3::UnitY(), 0.3);
    s.bodies[0].inverse_inertia.setZero();
    EXPECT_EQ(solve_by_pivoting(s.bodies, s.contacts).fallbacks, 0u);
    EXPECT_LT((s.bodies[0].velocity - (3 - 0.3 * 0.5) * along).norm(), 1e-12);
  }
}

// Slopes just below and above the friction angle, in a direction between the axes: the box is held exactly,
// or slides by the difference.
TEST(FrictionLcp, InclineHoldsToTheAngleOfFriction) {
  const Vec3 across = Vec3(0.6, 0, 0.8);
  for (const Real slope : {0.0, 0.3, 0.4999999, 0.5000001, 0.9}) {
    ContactSample s = stacked_boxes(1, slope * across - Vec3::UnitY(), 0.5);
    s.bodies[0].inverse_inertia.setZero();
    solve_by_pivoting(s.bodies, s.contacts);
    EXPECT_LT((s.bodies[0].velocity - std::max(0.0, slope - 0.5) * across).norm(), 1e-12) << slope;
  }
}

TEST(FrictionLcp, AnisotropicAxesHaveTheirOwnLimits) {
  ContactSample s = stacked_boxes(1, Vec3(3, -1, 2), 0);
  s.bodies[0].inverse_inertia.setZero();
  for (Contact& c : s.contacts) {
    c.frame = {Vec3::UnitY(), Vec3::UnitZ(), Vec3::UnitX()};
    c.friction_t = 0.25;
    c.friction_k = 0.75;
  }
  solve_by_pivoting(s.bodies, s.contacts);
  EXPECT_LT((s.bodies[0].velocity - Vec3(2.25, 0, 1.75)).norm(), 1e-12);
}

// Painleve's rod, inclined on ground so rough that sliding friction alone would pull it into the ground: K_nn
// < mu K_nt.
TEST(FrictionLcp, AJammingRodHasABoundedImpulse) {
  for (const Real mu : {0.5, 1.5, 5.0, 50.0})
    for (const Real speed : {-2.0, 2.0}) {
      ContactSample s;
      s.bodies = {box_body(1, Vec3(0.01, 2, 0.01)), ContactBody{}};
      s.bodies[0].velocity = Vec3(speed, -0.1, 0);
      const Vec3 arm(-0.6, -0.8, 0);
      s.contacts = {contact_between(0, 1, Vec3::UnitY(), arm, Vec3::Zero(), mu)};
      s.bodies[0].inverse_inertia = Mat3(Vec3(3, 3, 3).asDiagonal());
      const Real energy = s.kinetic_energy();
      const ContactWork work = solve_by_pivoting(s.bodies, s.contacts);
      EXPECT_LT(work.residual, 1e-9);
      EXPECT_LT(work.iterations, 20'000u);
      EXPECT_LT(s.kinetic_energy(), energy + 1e-12);
      expect_law(s, 1e-8);
    }
}

// A wedge between two approaching walls cannot give way: there is no solution. The solver must stop and count
// a fall-back.
TEST(FrictionLcp, AnUnsolvableSqueezeStopsAndIsCounted) {
  ContactSample s;
  s.bodies = {sphere_body(1, 1), ContactBody{.velocity = Vec3(-1, 0, 0)},
              ContactBody{.velocity = Vec3(1, 0, 0)}};
  s.contacts = {contact_between(0, 1, -Vec3::UnitX(), Vec3::UnitX(), Vec3::Zero(), 0.5),
                contact_between(0, 2, Vec3::UnitX(), -Vec3::UnitX(), Vec3::Zero(), 0.5)};
  const ContactWork work = solve_by_pivoting(s.bodies, s.contacts);
  EXPECT_EQ(work.fallbacks, 1u);
  EXPECT_GT(work.residual, 0.1);
  EXPECT_TRUE(s.bodies[0].velocity.allFinite());
}

TEST(FrictionLcp, TheGuessIsIgnoredAndNoContactsAreNoWork) {
  ContactSample s = stacked_boxes(2, Vec3(1, -1, 0), 0.5), other = s;
  for (Contact& c : other.contacts) c.impulse = Vec3(7, 1, -1);
  solve_by_pivoting(s.bodies, s.contacts);
  solve_by_pivoting(other.bodies, other.contacts);
  for (std::size_t i = 0; i < s.contacts.size(); ++i)
    EXPECT_EQ(s.contacts[i].impulse, other.contacts[i].impulse);
  EXPECT_EQ(solve_by_pivoting(s.bodies, {}).solves, 0u);
}

// Rows and columns are added, removed and changed in any order; the factorization stays that of the current
// matrix.
TEST(UpdatedQr, FollowsEveryChange) {
  Dice dice(6);
  constexpr Eigen::Index kMost = 20;
  UpdatedQr factor(kMost);
  Eigen::MatrixXd M(0, 0);
  const auto random = [&](Eigen::Index n) {
    Eigen::VectorXd v(n);
    for (Real& x : v) x = dice.uniform(-1, 1);
    return v;
  };
  const auto position = [&] {
    return static_cast<Eigen::Index>(dice.index(static_cast<std::size_t>(M.rows())));
  };
  int solved = 0;
  for (int step = 0; step < 2000; ++step) {
    const Eigen::Index n = M.rows(), kind = n == 0 ? 0 : dice.index(3);
    if (kind == 0 && n < kMost) {
      const Eigen::VectorXd row = random(n), column = random(n);
      M.conservativeResize(n + 1, n + 1);
      M.row(n) << row.transpose(), 3;
      M.col(n).head(n) = column;
      factor.append(row, column, 3);
    } else if (kind == 1 && n > 0) {
      const Eigen::Index r = position(), c = position();
      Eigen::MatrixXd less(n - 1, n - 1);
      for (Eigen::Index i = 0; i < n - 1; ++i)
        for (Eigen::Index j = 0; j < n - 1; ++j) less(i, j) = M(i + (i >= r), j + (j >= c));
      M = less;
      factor.remove(r, c);
    } else if (n > 0) {
      const Eigen::Index c = position();
      const Eigen::VectorXd by = random(n);
      M.middleCols(c, n - 1 - c) = M.rightCols(n - 1 - c).eval();
      M.col(n - 1) = by;
      factor.replace(c, by);
    }
    Eigen::VectorXd x = random(M.rows());
    const Eigen::VectorXd b = x;
    ASSERT_EQ(factor.size(), M.rows());
    if (!factor.solve(x)) continue;
    ++solved;
    ASSERT_LT((M * x - b).norm(), 1e-11 * (1 + x.norm()));
  }
  EXPECT_GT(solved, 1900);
}

}  // namespace
}  // namespace offstage::sim
