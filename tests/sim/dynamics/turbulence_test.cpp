#include "sim/dynamics/turbulence.h"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace offstage::sim {
namespace {

std::vector<Real> random_points(std::size_t count, Real extent) {
  std::mt19937 random(5);
  std::uniform_real_distribution<Real> at(-extent, extent);
  std::vector<Real> x(3 * count);
  for (Real& v : x) v = at(random);
  return x;
}

std::vector<Real> velocities(const Turbulence& turbulence, Real time, const std::vector<Real>& x) {
  std::vector<Real> v(x.size());
  TurbulentFlow(turbulence, time).velocity(x, v);
  return v;
}

Real correlation(const std::vector<Real>& a, const std::vector<Real>& b) {
  Real ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) ab += a[i] * b[i], aa += a[i] * a[i], bb += b[i] * b[i];
  return ab / std::sqrt(aa * bb);
}

// A tile has 1024^3 cells, so 200 000 points lie in about as many different cells: 3 sigma of the mean square
// is 1 %.
TEST(Turbulence, HasItsSpeedInEachDirectionAtAnyTimeAndNoMean) {
  const std::vector<Real> x = random_points(200'000, 400);
  for (uint32_t octaves : {1u, 3u})
    for (Real time : {0.0, 0.5, 1.23, 1e4 + 0.7}) {
      const auto v = velocities({.speed = 3, .scale = 0.8, .octaves = octaves, .lifetime = 1}, time, x);
      Vec3 mean = Vec3::Zero(), square = Vec3::Zero();
      for (std::size_t i = 0; i < v.size(); i += 3) {
        const Vec3 u(v[i], v[i + 1], v[i + 2]);
        mean += u / 200'000;
        square += u.cwiseAbs2() / 200'000;
      }
      EXPECT_NEAR(mean.cwiseAbs().maxCoeff(), 0, 0.02);
      EXPECT_NEAR(square.sum(), 9, 0.09) << octaves << ' ' << time;
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(square[k], 3, 0.05);
    }
}

// By central differences. Their error comes from single precision (1e-7 / h) and from jumps of the second
// derivative at the cell faces (of order h).
TEST(Turbulence, HasNoDivergence) {
  const TurbulentFlow flow({.speed = 1, .scale = 1, .octaves = 3}, 0.37);
  const std::vector<Real> x = random_points(3000, 30);
  constexpr Real kH = 1e-3;
  Real worst = 0, gradient = 0;
  for (std::size_t i = 0; i < x.size(); i += 3) {
    Real divergence = 0;
    for (int k = 0; k < 3; ++k) {
      const Vec3 p(x[i], x[i + 1], x[i + 2]), step = kH * Vec3::Unit(k);
      const Real slope = (flow.velocity(p + step)[k] - flow.velocity(p - step)[k]) / (2 * kH);
      divergence += slope;
      gradient += slope * slope / static_cast<Real>(x.size());
    }
    worst = std::max(worst, std::abs(divergence));
  }
  EXPECT_GT(std::sqrt(gradient), 2);
  EXPECT_LT(worst, 4e-3);
}

// After some turnovers of the eddies, the number of particles in cubes in the middle of the cloud is Poisson
// distributed: its variance equals its mean, with a statistical error of sqrt(2 / 1000).
TEST(Turbulence, KeepsDriftingParticlesEvenlySpread) {
  std::vector<Real> x = random_points(60'000, 16), half(x.size()), v(x.size());
  constexpr Real kH = 0.05;
  for (int i = 0; i < 60; ++i) {  // midpoint rule
    const Turbulence air{.speed = 1, .scale = 1, .octaves = 1};
    TurbulentFlow(air, i * kH).velocity(x, v);
    for (std::size_t k = 0; k < x.size(); ++k) half[k] = x[k] + kH / 2 * v[k];
    TurbulentFlow(air, (i + 0.5) * kH).velocity(half, v);
    for (std::size_t k = 0; k < x.size(); ++k) x[k] += kH * v[k];
  }
  std::vector<int> count(1000);
  for (std::size_t i = 0; i < x.size(); i += 3) {
    const Vec3 cell = (Vec3(x[i], x[i + 1], x[i + 2]).array() + 5).floor();
    if (cell.minCoeff() >= 0 && cell.maxCoeff() < 10)
      ++count[static_cast<std::size_t>(100 * cell.x() + 10 * cell.y() + cell.z())];
  }
  Real mean = 0, variance = 0;
  for (int n : count) mean += n / 1000.0;
  for (int n : count) variance += (n - mean) * (n - mean) / 1000;
  EXPECT_NEAR(mean, 60'000 / std::pow(32, 3), 0.15);
  EXPECT_NEAR(variance / mean, 1, 0.14);
}

TEST(Turbulence, EddiesLiveForTheirLifetimeAndTurnOverByDefault) {
  const std::vector<Real> x = random_points(50'000, 400);
  for (const Turbulence& t : {Turbulence{.speed = 2, .scale = 3, .octaves = 1, .lifetime = 1.5},
                              Turbulence{.speed = 2, .scale = 3, .octaves = 1}}) {
    const auto now = velocities(t, 10.2, x);
    EXPECT_GT(correlation(now, velocities(t, 10.2 + 0.01, x)), 0.999);
    EXPECT_LT(correlation(now, velocities(t, 10.2 + 1.5, x)), 0.6);
    EXPECT_NEAR(correlation(now, velocities(t, 10.2 + 3, x)), 0, 0.02);
  }
}

TEST(Turbulence, DriftsWithItsWindAndRepeatsAfterATileOnly) {
  const std::vector<Real> x = random_points(2000, 20);
  const Turbulence still{.speed = 1, .scale = 0.5, .octaves = 2};
  Turbulence drifting = still;
  drifting.drift = {3, -1, 2};
  auto moved = x, tile = x, half = x;
  for (std::size_t i = 0; i < x.size(); ++i) {
    moved[i] += 4 * drifting.drift[static_cast<Eigen::Index>(i % 3)];
    tile[i] -= 512;
    half[i] -= 256;
  }
  const auto v = velocities(still, 4, x), w = velocities(drifting, 4, moved), u = velocities(still, 4, tile);
  for (std::size_t i = 0; i < x.size(); ++i) {
    EXPECT_NEAR(v[i], w[i], 1e-5);
    EXPECT_NEAR(v[i], u[i], 1e-5);
  }
  // the octave of half the width repeats twice per tile
  const Turbulence alone{.speed = 1, .scale = 0.5, .octaves = 1};
  EXPECT_NEAR(correlation(velocities(alone, 4, x), velocities(alone, 4, half)), 0, 0.06);
}

TEST(Turbulence, SeedsAndOctavesAreIndependent) {
  const std::vector<Real> x = random_points(20'000, 200);
  Turbulence a{.octaves = 1}, b = a;
  b.seed = 1;
  EXPECT_NEAR(correlation(velocities(a, 0, x), velocities(b, 0, x)), 0, 0.03);
  // The second octave is half as wide. Without its own random stream it would be a scaled copy of the first.
  b = a;
  b.octaves = 2;
  const auto both = velocities(b, 0, x), first = velocities(a, 0, x);
  const Real fraction = 1 / std::sqrt(1 + std::pow(2, -2.0 / 3));
  EXPECT_NEAR(correlation(both, first), fraction, 0.02);
}

TEST(Turbulence, AtAPointDoesNotDependOnOtherPointsAndIsFiniteFarAway) {
  std::vector<Real> x = random_points(19, 5);
  x[4] = 1e6, x[20] = -1e18, x[21] = 1e300, x[40] = -0.0;
  const Turbulence t{.octaves = Turbulence::kMaxOctaves};
  const auto v = velocities(t, 0.1, x);
  for (std::size_t i = 0; i < 19; ++i) {
    const Vec3 alone = TurbulentFlow(t, 0.1).velocity({x[3 * i], x[3 * i + 1], x[3 * i + 2]});
    EXPECT_TRUE(alone.allFinite());
    EXPECT_EQ(alone, Vec3(v[3 * i], v[3 * i + 1], v[3 * i + 2]));
  }
}

}  // namespace
}  // namespace offstage::sim
