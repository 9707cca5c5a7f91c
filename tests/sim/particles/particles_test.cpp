#include "sim/particles/particles.h"

#include <gtest/gtest.h>

namespace offstage::sim {
namespace {

const Vec3 kNormal = Vec3(1, 2, -1).normalized();
const Vec3 kTangent = kNormal.cross(Vec3::UnitX()).normalized();

// Critical friction coefficient: |u_t| / ((1 + e) |u_n|).
TEST(Impulse, SticksAboveTheCriticalFrictionAndSlidesBelow) {
  constexpr Real kMass = 0.7, kE = 0.5;
  const Vec3 u = -3 * kNormal + 2 * kTangent;
  const Real critical = 2 / ((1 + kE) * 3);
  for (Real mu : {critical * 1.001, critical * 5}) {
    const Vec3 after = u + collision_impulse(kMass, u, kNormal, kE, mu) / kMass;
    EXPECT_NEAR((after - kE * 3 * kNormal).norm(), 0, 1e-12);
  }
  for (Real mu : {0.0, critical * 0.3, critical * 0.999}) {
    const Vec3 P = collision_impulse(kMass, u, kNormal, kE, mu), after = u + P / kMass;
    EXPECT_NEAR(after.dot(kNormal), kE * 3, 1e-12);
    EXPECT_NEAR(after.dot(kTangent), 2 - mu * (1 + kE) * 3, 1e-12);
    EXPECT_NEAR(P.dot(kTangent), -mu * P.dot(kNormal), 1e-12);
  }
}

TEST(Impulse, NeverAddsEnergyAndElasticPairsKeepMomentumEnergyAndAngularMomentum) {
  uint32_t state = 1;
  const auto real = [&] {
    return static_cast<Real>((state = state * 1664525u + 1013904223u) >> 8) / (1 << 23) - 1;
  };
  for (int k = 0; k < 1000; ++k) {
    const Real m1 = 1.1 + real(), m2 = 1.1 + real(), m12 = m1 * m2 / (m1 + m2);
    const Vec3 v1(real(), real(), real()), v2(real(), real(), real()), contact(real(), real(), real());
    Vec3 n = Vec3(real(), real(), real()).normalized();
    if ((v1 - v2).dot(n) > 0) n = -n;
    const auto energy = [&](const Vec3& a, const Vec3& b) {
      return m1 * a.squaredNorm() / 2 + m2 * b.squaredNorm() / 2;
    };

    const Vec3 P = collision_impulse(m12, v1 - v2, n, 1, 0), w1 = v1 + P / m1, w2 = v2 - P / m2;
    ASSERT_NEAR((m1 * w1 + m2 * w2 - m1 * v1 - m2 * v2).norm(), 0, 1e-12);
    ASSERT_NEAR(energy(w1, w2), energy(v1, v2), 1e-12);
    // The centres of colliding particles lie along n about the contact point.
    const Vec3 r1 = contact + 0.3 * n, r2 = contact - 0.2 * n;
    ASSERT_NEAR((m1 * r1.cross(w1 - v1) + m2 * r2.cross(w2 - v2)).norm(), 0, 1e-12);

    const Vec3 Q = collision_impulse(m12, v1 - v2, n, std::abs(real()), std::abs(real()));
    ASSERT_LE(energy(v1 + Q / m1, v2 - Q / m2), energy(v1, v2) + 1e-12);
  }
}

}  // namespace
}  // namespace offstage::sim
