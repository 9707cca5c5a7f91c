#include "effects/blackbody.h"

#include <cmath>

#include <gtest/gtest.h>

namespace offstage::effects {
namespace {

// Chromaticities of the Planckian locus (CIE 1931, Kim et al. 2002 and tables), as linear sRGB divided by
// luminance.
TEST(Blackbody, LiesOnThePlanckianLocus) {
  struct Known {
    float kelvin, x, y;
  };
  for (const Known& k : {Known{2000, 0.5267f, 0.4133f},
                         {3000, 0.4369f, 0.4041f},
                         {5000, 0.3451f, 0.3516f},
                         {6500, 0.3135f, 0.3237f},
                         {10000, 0.2807f, 0.2884f}}) {
    const Eigen::Vector3f c = blackbody_color(k.kelvin);
    Eigen::Matrix3f xyz_from_rgb;
    xyz_from_rgb << 0.4124564f, 0.3575761f, 0.1804375f, 0.2126729f, 0.7151522f, 0.0721750f, 0.0193339f,
        0.1191920f, 0.9503041f;
    const Eigen::Vector3f xyz = xyz_from_rgb * c;
    EXPECT_NEAR(xyz.x() / xyz.sum(), k.x, 0.004) << k.kelvin;
    EXPECT_NEAR(xyz.y() / xyz.sum(), k.y, 0.004) << k.kelvin;
    EXPECT_NEAR(xyz.y(), 1, 1e-3);
  }
}

TEST(Blackbody, IsNeverNegativeAndTurnsFromRedToBlue) {
  float last = 1e9f;
  for (float t = 100; t < 20'000; t *= 1.05f) {
    const Eigen::Vector3f c = blackbody_color(t);
    EXPECT_GE(c.minCoeff(), 0);
    EXPECT_NEAR(c.dot(Eigen::Vector3f(0.2126729f, 0.7151522f, 0.0721750f)), 1, 1e-3);
    EXPECT_LE(c.x(), last * 1.0001f);
    last = c.x();
  }
}

// Wien's law: the logarithm falls by h c / (k lambda) (1/T - 1/T0), with lambda near 600 nm, where the eye is
// sensitive.
TEST(Blackbody, BrightnessFollowsWien) {
  EXPECT_EQ(blackbody_brightness(1800, 1800), 1);
  for (float t : {1000.f, 1400.f, 2500.f}) {
    const float wavelength = 1.4388e-2f * (1 / 1800.f - 1 / t) / std::log(blackbody_brightness(t, 1800));
    EXPECT_NEAR(wavelength * 1e9f, 600, 30) << t;
  }
}

}  // namespace
}  // namespace offstage::effects
