// The progress line of a terminal, and the format of durations.

#include "producer/run/progress.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "producer/run/time_left.h"

namespace offstage::producer {
namespace {

Progress halfway() {
  return {.done = 75,
          .total = 150,
          .sim_ms = 12,
          .render_ms = 340,
          .encode_ms = 8,
          .particles = 20000,
          .eta_s = 80,
          .fraction = 0.5};
}

TEST(Progress, DurationsUseHoursMinutesAndSeconds) {
  EXPECT_EQ(duration_text(0.2), "1 s");
  EXPECT_EQ(duration_text(59), "59 s");
  EXPECT_EQ(duration_text(125), "2 min 05 s");
  EXPECT_EQ(duration_text(4800), "1 h 20 min");
  EXPECT_NO_THROW(duration_text(1e300));
}

TEST(Progress, TheLineFitsATerminalOfAnyWidth) {
  for (int width = 1; width <= 200; ++width) {
    const std::string line = progress_bar(halfway(), width);
    EXPECT_LT(static_cast<int>(line.size()), std::max(width, 9)) << line;
    EXPECT_EQ(line.find_first_of("\n\r\033"), std::string::npos);
    EXPECT_TRUE(width < 10 || line.find("50 %") != std::string::npos) << width;
    EXPECT_TRUE(width < 60 || line.find("1 min 20 s left") != std::string::npos) << line;
  }
  const std::string wide = progress_bar(halfway(), 120);
  EXPECT_NE(wide.find("frame 75/150"), std::string::npos) << wide;
  EXPECT_NE(wide.find("draw 340 ms"), std::string::npos) << wide;
}

TEST(Progress, TheBarGrowsWithTheWork) {
  long before = -1;
  for (const double fraction : {0.0, 0.1, 0.5, 0.9, 1.0}) {
    Progress p = halfway();
    p.fraction = fraction;
    const std::string line = progress_bar(p, 100);
    const long filled = std::ranges::count(line, '=');
    EXPECT_GT(filled, before);
    before = filled;
  }
  EXPECT_EQ(before, 25);
}

TEST(Progress, BeforeTheFirstFrameItNamesTheSimulation) {
  const std::string line = progress_bar(
      {.done = 0, .total = 1, .fraction = 0.3, .frames_simulated = 270, .frames_to_simulate = 900}, 100);
  EXPECT_NE(line.find("simulating frame 270/900"), std::string::npos) << line;
}

TEST(Progress, TheRemainingTimeDoesNotRepeatTheCostOfTheFirstFrame) {
  constexpr int kFrames = 16, kThreads = 2;
  constexpr double kFirst_s = 4, kOther_s = 0.25;
  TimeLeft left(kFrames, kFrames, kThreads, 300);
  double now = kFirst_s;
  for (int frame = 0; frame < kFrames; ++frame) left.simulated(1);
  left.finished(1000 * kFirst_s, now);
  EXPECT_FALSE(left.is_steady());
  left.finished(1000 * kFirst_s, now);  // the first frame of the other thread
  EXPECT_FALSE(left.is_steady());
  for (int frame = kThreads; frame < kFrames; frame += kThreads) {
    now += kOther_s;
    left.finished(1000 * kOther_s, now);
    left.finished(1000 * kOther_s, now);
    EXPECT_TRUE(left.is_steady());
    EXPECT_NEAR(left.seconds(now), kOther_s * (kFrames - frame - kThreads) / kThreads, 1e-9);
  }
  EXPECT_EQ(left.fraction(), 1);
}

TEST(Progress, TheRemainingTimeOfASimulationIsProportionalToItsFrames) {
  TimeLeft left(100, 100, 0, 0);
  for (int frame = 0; frame < 25; ++frame) {
    left.simulated(20);
    left.finished(0, 0.02 * (frame + 1));
  }
  EXPECT_NEAR(left.fraction(), 0.25, 1e-12);
  EXPECT_NEAR(left.seconds(0.5), 1.5, 1e-12);
}

}  // namespace
}  // namespace offstage::producer
