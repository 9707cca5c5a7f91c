#include "sim/dynamics/pair_forces.h"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <oneapi/tbb/task_arena.h>

#include "sim/dynamics/flat.h"

namespace offstage::sim {
namespace {

/// Particles at random places in a cube, with random masses and charges.
struct Swarm {
  Swarm(std::size_t count, Real size) {
    std::mt19937 random(3);
    std::uniform_real_distribution<Real> at(0, size), mass(0.5, 2), charge(-1, 1);
    for (std::size_t i = 0; i < count; ++i) {
      members.push_back({i, mass(random), charge(random)});
      for (int k = 0; k < 3; ++k) x.push_back(at(random));
    }
  }

  PairForces under(const ForceDef& def) const {
    PairForces forces;
    forces.add(def, members);
    return forces;
  }
  std::vector<Real> accelerations(const ForceDef& def) const {
    std::vector<Real> dv(x.size(), 0.0);
    under(def).accelerate(x, dv);
    return dv;
  }

  std::vector<PairMember> members;
  std::vector<Real> x;
};

const SphereRegion kRegion{{0.5, 0.5, 0.5}, 0.7};

std::vector<ForceDef> all_laws(Real cut_off) {
  return {{.effect = MutualGravitation{.constant = 2, .cut_off = cut_off}},
          {.effect = MutualGravitation{.constant = 2, .softening = 0.2, .cut_off = cut_off}},
          {.effect = Coulomb{.constant = 3, .cut_off = cut_off}},
          {.effect = LennardJones{.epsilon = 0.7, .sigma = 0.2, .cut_off = cut_off}}};
}

TEST(PairForces, AreMinusTheSlopeOfTheirEnergy) {
  for (Real cut_off : {0.0, 0.6})
    for (const ForceDef& def : all_laws(cut_off)) {
      Swarm swarm(12, 1);
      const auto dv = swarm.accelerations(def);
      for (std::size_t i = 0; i < dv.size(); ++i) {
        const Real place = swarm.x[i], h = 1e-6;
        swarm.x[i] = place + h;
        const Real above = swarm.under(def).potential_energy(0, swarm.x);
        swarm.x[i] = place - h;
        const Real below = swarm.under(def).potential_energy(0, swarm.x);
        swarm.x[i] = place;
        const Real force = swarm.members[i / 3].mass * dv[i];
        EXPECT_NEAR(force, (below - above) / (2 * h), 1e-6 * std::max(1.0, std::abs(force)));
      }
    }
}

// F = G m1 m2 / r^2 and K q1 q2 / r^2. Lennard-Jones: 24 e / sigma at r = sigma, and zero at r = 2^(1/6)
// sigma, where U = -e.
TEST(PairForces, OfTwoParticlesAgreeWithClosedForms) {
  const std::vector<Real> x = {0, 0, 0, 0, 2, 0};
  const auto pull = [&](const ForceDef& def) {
    PairForces forces;
    forces.add(def, {{0, 4, 1e-4}, {1, 5, -3e-4}});
    std::vector<Real> dv(6);
    forces.accelerate(x, dv);
    EXPECT_EQ(4 * dv[1], -5 * dv[4]);
    return std::pair(4 * dv[1], forces.potential_energy(0, x));
  };
  EXPECT_DOUBLE_EQ(pull({.effect = MutualGravitation{}}).first, 6.672e-11 * 20 / 4);
  EXPECT_DOUBLE_EQ(pull({.effect = MutualGravitation{}}).second, -6.672e-11 * 20 / 2);
  EXPECT_DOUBLE_EQ(pull({.effect = Coulomb{}}).first, 8.9875e9 * 3e-8 / 4);
  EXPECT_DOUBLE_EQ(pull({.effect = LennardJones{.epsilon = 3, .sigma = 2}}).first, -24 * 3 / 2.0);
  const auto rest = pull({.effect = LennardJones{.epsilon = 3, .sigma = 2 / std::pow(2, 1 / 6.0)}});
  EXPECT_NEAR(rest.first, 0, 1e-12);
  EXPECT_NEAR(rest.second, -3, 1e-12);
}

TEST(PairForces, KeepMomentumAndAngularMomentum) {
  const Swarm swarm(301, 1);
  for (Real cut_off : {0.0, 0.25})
    for (ForceDef def : all_laws(cut_off)) {
      std::visit(
          [](auto& effect) {
            if constexpr (requires { effect.region; }) effect.region = kRegion, effect.drop_rate = 1;
          },
          def.effect);
      const auto dv = swarm.accelerations(def);
      Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
      Real scale = 0;
      for (std::size_t i = 0; i < swarm.members.size(); ++i) {
        const Vec3 f = swarm.members[i].mass * vec3(std::span<const Real>(dv), 3 * i);
        force += f;
        torque += vec3(std::span<const Real>(swarm.x), 3 * i).cross(f);
        scale += f.norm();
      }
      EXPECT_GT(scale, 0);
      EXPECT_LT(force.norm(), 1e-14 * scale);
      EXPECT_LT(torque.norm(), 1e-14 * scale);
    }
}

TEST(PairForces, WithACutOffSumOverNearPairsOnly) {
  const Swarm swarm(2000, 1);
  constexpr Real kCutOff = 0.13;
  const auto dv = swarm.accelerations({.effect = Coulomb{.constant = 1, .cut_off = kCutOff}});
  for (std::size_t i = 0; i < swarm.members.size(); ++i) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t j = 0; j < swarm.members.size(); ++j) {
      const Vec3 d =
          vec3(std::span<const Real>(swarm.x), 3 * i) - vec3(std::span<const Real>(swarm.x), 3 * j);
      const Real r = d.norm();
      if (j != i && r < kCutOff) sum += swarm.members[j].charge / (r * r * r) * d;
    }
    sum *= swarm.members[i].charge / swarm.members[i].mass;
    ASSERT_NEAR((vec3(std::span<const Real>(dv), 3 * i) - sum).norm(), 0, 1e-9 * std::max(1.0, sum.norm()));
  }
}

TEST(PairForces, OfAParticleAtNanActOnNone) {
  for (Real cut_off : {0.0, 0.5})
    for (const ForceDef& def : all_laws(cut_off)) {
      Swarm swarm(20, 1);
      for (std::size_t k = 0; k < 3; ++k) swarm.x[3 * 7 + k] = std::nan("");
      const auto with = swarm.accelerations(def);
      swarm.members.erase(swarm.members.begin() + 7);
      const auto without = swarm.accelerations(def);
      for (std::size_t i = 0; i < with.size(); ++i) {
        const Real expected = i / 3 == 7 ? with[i] : without[i];
        EXPECT_NEAR(with[i], expected, 1e-9 * std::max(1.0, std::abs(with[i])));
      }
    }
}

TEST(PairForces, InARegionAreWeakenedByBothStrengths) {
  const std::vector<Real> x = {0, 0, 0, 0.5, 0, 0};
  PairForces forces;
  const ForceDef def{
      .effect = MutualGravitation{.constant = 1, .region = SphereRegion{{0, 0, 0}, 2}, .drop_rate = 1}};
  forces.add(def, {{0, 2, 0}, {1, 3, 0}});
  std::vector<Real> dv(6);
  forces.accelerate(x, dv);
  EXPECT_NEAR(2 * dv[0], 1 * 0.75 * 6 / 0.25, 1e-12);
  EXPECT_NEAR(3 * dv[3], -1 * 0.75 * 6 / 0.25, 1e-12);
}

TEST(PairForces, DerivativesAgreeWithDifferences) {
  for (const ForceDef& def : all_laws(0)) {
    Swarm swarm(6, 1);
    const PairForces forces = swarm.under(def);
    const auto n = static_cast<Eigen::Index>(swarm.x.size());
    SparseEntries entries;
    forces.jacobian(swarm.x, 0, 0, entries);
    Eigen::MatrixXd exact = Eigen::MatrixXd::Zero(n, n);
    for (const auto& e : entries) exact(e.row(), e.col()) += e.value();
    for (Eigen::Index k = 0; k < n; ++k) {
      const Real h = 1e-6;
      auto low = swarm, high = swarm;
      low.x[static_cast<std::size_t>(k)] -= h;
      high.x[static_cast<std::size_t>(k)] += h;
      const auto a = low.accelerations(def), b = high.accelerations(def);
      for (Eigen::Index i = 0; i < n; ++i) {
        const auto at = static_cast<std::size_t>(i);
        EXPECT_NEAR(exact(i, k), (b[at] - a[at]) / (2 * h),
                    1e-5 * std::max(1.0, exact.cwiseAbs().maxCoeff()));
      }
    }
  }
}

TEST(PairForces, AreTheSameBitsForAnyThreadsAndFiniteForAnyPlaces) {
  Swarm swarm(1000, 1);
  // Two particles at the same place, two almost so, and one at NaN.
  for (std::size_t k = 0; k < 3; ++k) {
    swarm.x[3 + k] = swarm.x[k];
    swarm.x[9 + k] = swarm.x[6 + k] + (k == 0 ? 1e-17 : 0);
    swarm.x[12 + k] = std::nan("");
  }
  for (Real cut_off : {0.0, 0.2})
    for (const ForceDef& def : all_laws(cut_off)) {
      std::vector<Real> one, two;
      tbb::task_arena(1).execute([&] { one = swarm.accelerations(def); });
      tbb::task_arena(2).execute([&] { two = swarm.accelerations(def); });
      EXPECT_EQ(one, two);
      for (Real a : one) ASSERT_TRUE(std::isfinite(a));
    }
}

}  // namespace
}  // namespace offstage::sim
