// Frame rates as fractions, and the times of the frames.

#include "render/frame_rate.h"

#include <cmath>

#include <gtest/gtest.h>

#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"

namespace offstage::producer {
namespace {

using render::FrameRate;

TEST(FrameRate, ANumberBecomesTheSimplestFractionThatRoundsToIt) {
  EXPECT_EQ(render::frame_rate_of(24), FrameRate(24));
  EXPECT_EQ(render::frame_rate_of(29.97), FrameRate(2997, 100));
  EXPECT_EQ(render::frame_rate_of(23.976), FrameRate(2997, 125));
  EXPECT_EQ(render::frame_rate_of(12.5), FrameRate(25, 2));
  EXPECT_EQ(render::frame_rate_of(30000.0 / 1001), FrameRate(30000, 1001));
  EXPECT_EQ(render::frame_rate_of(1 / 3.0), FrameRate(1, 3));
  for (const double odd : {M_PI, M_E, std::sqrt(2.0), 999.123456789012}) {
    const FrameRate rate = render::frame_rate_of(odd);
    EXPECT_NEAR(rate.per_second(), odd, 2e-12 * odd);
    EXPECT_LE(rate.denominator, 1'000'000);
  }
}

TEST(FrameRate, ATextIsANumberOrAFractionInLowestTerms) {
  EXPECT_EQ(render::parse_frame_rate("25"), FrameRate(25));
  EXPECT_EQ(render::parse_frame_rate("30000/1001"), FrameRate(30000, 1001));
  EXPECT_EQ(render::parse_frame_rate("60/2"), FrameRate(30));
  EXPECT_EQ(render::parse_frame_rate("30000/1001")->text(), "30000/1001");
  for (const char* wrong : {"", "abc", "0", "-24", "30/0", "0/1", "30/", "/1", "30000:1001", "24 ", "24fps",
                            "nan", "1e9", "99999999999/1", "30/1001/2"})
    EXPECT_FALSE(render::parse_frame_rate(wrong)) << wrong;
}

TEST(FrameRate, ASceneTakesAFractionAndWritesItBack) {
  const LoadedScene film = parse_scene(R"({"output": {"fps": "30000/1001", "duration": 10.01}})", "s", "");
  EXPECT_EQ(film.scene.output.fps, FrameRate(30000, 1001));
  EXPECT_EQ(film.scene.frame_count(), 300);
  EXPECT_EQ(parse_scene(film.canonical, "s", "").scene.output.fps, FrameRate(30000, 1001));
  for (const char* wrong : {R"("5000/1")", R"("30/0")", R"("24")", R"("ntsc")", "true", "0.5"})
    EXPECT_THROW(parse_scene(std::string(R"({"output": {"fps": )") + wrong + "}}", "s", ""), SceneError)
        << wrong;
}

TEST(FrameRate, AWholeRateHasTheTimesItAlwaysHad) {
  for (const int fps : {24, 25, 30, 60}) {
    EXPECT_EQ(FrameRate(fps).seconds(1), 1.0 / fps);
    for (const int k : {3, 100, 9999}) EXPECT_EQ(FrameRate(fps).seconds(k), static_cast<double>(k) / fps);
  }
}

TEST(FrameRate, TenThousandFramesOfAFractionDoNotDrift) {
  // Sub-steps of at most 0.0333 s: one per frame at 30000/1001 would be longer, so there are two.
  const LoadedScene film = parse_scene(
      R"({"world": {"step": 0.0333}, "output": {"fps": "30000/1001", "duration": 334, "start": 0.5}})", "s",
      "");
  const ModelLibrary models;
  Simulation simulation(film.scene, models);
  double worst = 0;
  while (simulation.frame() < 10'000) {
    simulation.advance();
    if (simulation.frame() == 0) continue;
    const long double exact = 0.5L + (simulation.frame() - 1) * 1001.0L / 30000.0L;
    worst = std::max(worst, static_cast<double>(std::abs(simulation.world().time() - exact)));
  }
  EXPECT_LT(worst, 2e-13);  // a few rounding errors at 333 s, not the sum of 10 000
  EXPECT_EQ(simulation.snapshot().time, 0.5 + 9999 * 1001.0 / 30000);
}

}  // namespace
}  // namespace offstage::producer
