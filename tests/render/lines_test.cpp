// Lines of overlays as the stage draws them.

#include <cmath>
#include <limits>

#include "tests/render/gl_fixture.h"

namespace offstage::render {
namespace {

constexpr int kWidth = 96, kHeight = 64;
const Camera kCamera{.eye = {0, 0, 5}, .target = {0, 0, 0}};
const Vector4f kRed(1, 0, 0, 1);

// A stage with one set of lines that are `width_px` wide.
struct LinesScene {
  explicit LinesScene(float width_px, float hidden = 0)
      : lines(s.stage.add_lines({.width = width_px / kHeight, .hidden = hidden})) {}
  HdrImage draw(std::span<const Line> values) {
    s.stage.set_lines(lines, values);
    return s.draw();
  }
  HdrImage draw(const Line& line) { return draw(std::span(&line, 1)); }

  SmallStage s{kWidth, kHeight};
  LinesHandle lines;
};

double covered(const HdrImage& image) {
  double sum = 0;
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) sum += static_cast<double>(image.rgba[i]);
  return sum;
}

TEST(StageLines, CoverTheAreaOfTheirWidth) {
  LinesScene scene(6);
  for (const Line& line :
       {Line{{-1, 0.2f, 0}, {1, 0.2f, 0}, kRed}, Line{{-0.7f, -0.5f, 1}, {0.9f, 1, -2}, kRed},
        Line{{0.1f, -1, 0}, {0.1f, 1, 0}, kRed}}) {
    const HdrImage picture = scene.draw(line);
    const Vector2f a = project(kCamera, line.a, kWidth, kHeight),
                   b = project(kCamera, line.b, kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const Vector2f p(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
        const float t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.f, 1.f);
        const float d = (p - a - t * (b - a)).norm();
        ASSERT_NEAR(pixel(picture, x, y).w(), std::clamp(3.5f - d, 0.f, 1.f), 0.01f) << x << " " << y;
        ASSERT_EQ(pixel(picture, x, y).x(), pixel(picture, x, y).w());
      }
    }
  }
}

TEST(StageLines, DotIsADiscAndATaperedLineATriangle) {
  LinesScene scene(20);
  EXPECT_NEAR(covered(scene.draw({{0, 0, 0}, {0, 0, 0}, kRed})), 3.1416 * 100, 5);
  // An arrow head of 50 pixels that is 20 pixels wide at its base, from which half a disc protrudes.
  const float px = 10 * std::tan(20 * 0.01745329f) / kHeight;
  const Line arrow{{-25 * px, 0, 0}, {25 * px, 0, 0}, kRed, 1, 0};
  EXPECT_NEAR(covered(scene.draw(arrow)), 0.5 * 50 * 20 + 0.5 * 3.1416 * 100, 15);
}

TEST(StageLines, ThinLinesKeepTheirFractionOfLight) {
  const Line line{{-1, 0.137f, 0}, {1, 0.291f, 0}, kRed};
  const double wide = covered(LinesScene(1).draw(line));
  EXPECT_NEAR(covered(LinesScene(0.25f).draw(line)) / wide, 0.25, 0.01);
}

TEST(StageLines, LookAlikeInLargeAndSmallPictures) {
  const Line line{{-1, 0, 0}, {1, 0.3f, 0}, kRed};
  const auto fraction = [&](int scale) {
    SmallStage s(kWidth * scale, kHeight * scale);
    s.stage.set_lines(s.stage.add_lines({.width = 0.04f}), std::span(&line, 1));
    return covered(s.draw()) / (scale * scale);
  };
  EXPECT_NEAR(fraction(4) / fraction(1), 1, 0.02);
}

TEST(StageLines, AreOccludedOrShowFaintlyThroughSurfaces) {
  for (const float hidden : {0.f, 0.25f}) {
    LinesScene scene(8, hidden);
    scene.s.add(make_box({1, 1, 1}), {.color = {0, 0, 0, 1}, .roughness = 1, .emission = {0, 1, 0}});
    const Vector4f behind = center_pixel(scene.draw({{-2, 0, -1}, {2, 0, -1}, kRed}));
    const Vector4f without = center_pixel(scene.draw(std::span<const Line>()));
    EXPECT_NEAR(behind.x(), hidden + (1 - hidden) * without.x(), 1e-3f);
    EXPECT_NEAR(behind.y(), (1 - hidden) * without.y(), 1e-3f);
    EXPECT_NEAR(center_pixel(scene.draw({{-2, 0, 1}, {2, 0, 1}, kRed})).x(), 1, 1e-3f);
    // A line exactly on the surface is not cut by it.
    EXPECT_NEAR(center_pixel(scene.draw({{-2, 0, 0.5f}, {2, 0, 0.5f}, kRed})).x(), 1, 1e-3f);
  }
}

TEST(StageLines, NearerLinesCoverFartherOnesInAnyOrder) {
  LinesScene scene(8);
  const Line far{{-1, 0, -1}, {1, 0, -1}, kRed}, near{{0, -1, 1}, {0, 1, 1}, {0, 1, 0, 1}};
  for (const auto& lines : {std::array{far, near}, std::array{near, far}})
    EXPECT_EQ(center_pixel(scene.draw(lines)), Vector4f(0, 1, 0, 1));
}

TEST(StageLines, EndingBehindTheEyeAreCutAtTheNearPlane) {
  LinesScene scene(4);
  // The line runs below the eye, towards it and past it: in the picture, from the middle straight down to the
  // lower edge.
  const HdrImage picture = scene.draw({{0, -0.5f, -40}, {0, -0.5f, 20}, kRed});
  for (const int y : {40, 50, 62}) EXPECT_NEAR(pixel(picture, kWidth / 2, y).w(), 1, 1e-6);
  EXPECT_EQ(pixel(picture, kWidth / 2, 20).w(), 0);
  EXPECT_EQ(covered(scene.draw({{0, -0.5f, 6}, {0, 0.5f, 20}, kRed})), 0);
}

TEST(StageLines, NonFiniteLinesAreNotDrawn) {
  LinesScene scene(4);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(covered(scene.draw({{nan, 0, 0}, {0, 0, 0}, kRed})), 0);
}

TEST(StageLines, RemovedLinesAreNotDrawnAndTheirHandleIsRefused) {
  LinesScene scene(4);
  const Line line{{-1, 0, 0}, {1, 0, 0}, kRed};
  EXPECT_GT(covered(scene.draw(line)), 0);
  scene.s.stage.remove(scene.lines);
  EXPECT_EQ(covered(scene.s.draw()), 0);
  EXPECT_THROW(scene.s.stage.set_lines(scene.lines, {}), std::logic_error);
}

TEST(StageLines, TenThousandLinesAreDrawnTheSameEveryTime) {
  std::vector<Line> lines;
  for (int i = 0; i < 10'000; ++i) {
    const float t = static_cast<float>(i);
    const Vector3f p(2 * std::sin(t), 1.5f * std::sin(1.7f * t), 2 * std::sin(2.3f * t));
    lines.push_back({p, p + 0.2f * Vector3f(std::sin(3 * t), std::cos(t), std::cos(5 * t)), {1, 1, 1, 0.5f}});
  }
  LinesScene scene(1);
  EXPECT_EQ(scene.draw(lines).rgba, scene.draw(lines).rgba);
}

}  // namespace
}  // namespace offstage::render
