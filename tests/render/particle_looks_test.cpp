#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "render/bloom.h"
#include "render/gl_fixture.h"
#include "render/opacity_grid.h"
#include "render/splatter.h"

namespace offstage::render {
namespace {

const PuffAtlas& atlas() {
  static const PuffAtlas instance;
  return instance;
}

float spread(int i, double step) {
  const double x = (i + 1) * step;
  return static_cast<float>(x - std::floor(x));
}

// A cloud of round puffs in a picture of `scale` times 160 x 96, nearest first, in front of a plane at depth
// `plane_m`.
std::vector<Splat> cloud(float scale, float plane_m, SplatPicture& picture) {
  picture.width_px = static_cast<int>(160 * scale);
  picture.height_px = static_cast<int>(96 * scale);
  picture.depth.assign(static_cast<std::size_t>(picture.width_px * picture.height_px), plane_m);
  std::vector<Splat> splats;
  for (int i = 0; i < 400; ++i) {
    const float radius = scale * (14 + 10 * spread(i, 0.7548));
    Splat s{.x = scale * (40 + 80 * spread(i, 0.8192)),
            .y = scale * (30 + 36 * spread(i, 0.671)),
            .half_x = radius,
            .half_y = radius,
            .ux = 1 / radius,
            .uy = 0,
            .vx = 0,
            .vy = 1 / radius,
            .depth = 2 + 0.002f * static_cast<float>(i),
            .inverse_reach = 2,
            .opacity = 0.05f,
            .cover = 1,
            .radiance = {{1, 0.3f, 0.2f, 0.1f}, {0.8f, 0, 0.3f, 0}, {0.5f, 0, 0, 0.2f}},
            .cell = atlas().level(PuffAtlas::Kind::smoke, i % PuffAtlas::kVariants, 2 * radius)};
    splats.push_back(s);
  }
  return splats;
}

std::array<float, 4> pixel_of(const SplatPicture& picture, int x, int y) {
  const float* p = picture.rgbt.data() + 4 * (y * picture.width_px + x);
  return {p[0], p[1], p[2], p[3]};
}

TEST(Splatter, HalfTheSizeLooksTheSame) {
  SplatPicture full, half;
  const auto large = cloud(2, 5, full), small = cloud(1, 5, half);
  draw_splats(std::span<const Splat>(large), full);
  draw_splats(std::span<const Splat>(small), half);
  double difference = 0, covered = 0;
  float worst = 0;
  for (int y = 20; y < 76; ++y) {
    for (int x = 30; x < 130; ++x) {
      for (std::size_t c = 0; c < 4; ++c) {
        float mean = 0;
        for (int k = 0; k < 4; ++k) mean += 0.25f * pixel_of(full, 2 * x + (k & 1), 2 * y + (k >> 1))[c];
        const float off = std::abs(mean - pixel_of(half, x, y)[c]);
        worst = std::max(worst, off);
        difference += static_cast<double>(off);
      }
      covered += static_cast<double>(1 - pixel_of(half, x, y)[3]);
    }
  }
  EXPECT_GT(covered, 1000);
  EXPECT_LT(worst, 0.05f);
  EXPECT_LT(difference / (4 * 56 * 100), 0.008);
}

TEST(Splatter, DoesNotDependOnTheNumberOfThreads) {
  SplatPicture one, many;
  const auto splats = cloud(2, 5, one);
  cloud(2, 5, many);
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    draw_splats(std::span<const Splat>(splats), one);
  }
  draw_splats(std::span<const Splat>(splats), many);
  EXPECT_EQ(one.rgbt, many.rgbt);
}

TEST(Splatter, PuffFadesEvenlyAsAPlaneCutsThroughIt) {
  const auto shown_at = [](float plane_m) {
    SplatPicture picture;
    std::vector<Splat> splats = cloud(1, plane_m, picture);
    splats.resize(1);
    splats[0].x = 80;
    splats[0].y = 48;
    splats[0].opacity = 1;
    draw_splats(std::span<const Splat>(splats), picture);
    return 1 - pixel_of(picture, 80, 48)[3];
  };
  const float all = shown_at(10);  // the puff has its centre at 2 m and a radius of 0.25 m
  EXPECT_GT(all, 0.3f);
  for (int k = 0; k <= 10; ++k) {
    const float fraction = 0.1f * static_cast<float>(k);
    EXPECT_NEAR(shown_at(1.75f + 0.5f * fraction), fraction * all, 0.01f * all) << fraction;
  }
}

TEST(Splatter, StreakCoversAsMuchAsItsStroke) {
  for (const float angle : {0.0f, 0.4f, 1.2f, 1.5707f}) {
    const float c = std::cos(angle), s = std::sin(angle), half = 30, radius = 3;
    const StreakLight light = {.middle = {1, 1, 1}, .rim = {1, 1, 1}, .rim_slope = {}};
    const std::array streaks{StreakSplat{.x = 75,
                                         .y = 60,
                                         .half_x = half * c + radius,
                                         .half_y = half * s + radius,
                                         .along_x = c,
                                         .along_y = s,
                                         .half_length = half,
                                         .inverse_radius = 1 / radius,
                                         .depth = 2,
                                         .depth_slope = 0,
                                         .inverse_reach = 1,
                                         .opacity = 1,
                                         .cover = 1,
                                         .softness = 0.5f,
                                         .taper = 0,
                                         .light = &light}};
    StreakBands bands;
    bands.sort(streaks, 150, 120);
    const std::vector<float> depth(150 * StreakBands::kRows, 1.0f);
    double area = 0;
    for (int bottom = 0; bottom < 120; bottom += StreakBands::kRows) {
      const int rows = std::min(StreakBands::kRows, 120 - bottom);
      std::vector<float> rgba(150 * StreakBands::kRows * 4, 0.0f);
      bands.blend_over({0, bottom, 150, rows, depth, rgba}, {9, 0}, 0);
      for (std::size_t i = 3; i < rgba.size(); i += 4) area += static_cast<double>(rgba[i]);
    }
    // The soft rim counts half: 2 * 60 * 2.25, plus the ends.
    EXPECT_NEAR(area, 60 * 4.5 + 16, 4) << angle;
  }
}

TEST(OpacityGrid, TransmittanceFallsAlongTheLightByTheAbsorption) {
  const Vector3f away = Vector3f(0.3f, -1, 0.2f).normalized();
  std::vector<OpacityGrid::Absorber> absorbers;
  for (int i = 0; i < 2000; ++i)
    absorbers.push_back(
        {Vector3f(4 * spread(i, 0.8192), 4 * spread(i, 0.671), 4 * spread(i, 0.5497)), 0.3f, 0.02f});
  OpacityGrid grid;
  grid.build(absorbers, away);
  const Vector3f middle(2, 2, 2);
  float before = 0;
  for (float t = -6; t <= 6; t += 0.05f) {
    const float depth = grid.depth(middle + t * away);
    EXPECT_GE(depth, before - 1e-5f);
    before = depth;
  }
  EXPECT_EQ(grid.depth(middle - 6 * away), 0);
  // The cross-sections of 2000 puffs of 0.02 m^2 in 64 m^3, along a ray of about 4.25 m.
  EXPECT_NEAR(before, 2000 * 0.02f / 64 * 4 / std::abs(away.y()), 0.4f);
  EXPECT_EQ(grid.depth(middle + Vector3f(20, 0, 0)), 0);
  grid.build({}, away);
  EXPECT_TRUE(grid.empty());
  EXPECT_EQ(grid.depth(middle), 0);
}

HdrImage picture_of(float value) {
  HdrImage image{90, 70, std::vector<float>(90 * 70 * 4, value)};
  return image;
}

TEST(Bloom, LeavesPixelsBelowTheThresholdUnchanged) {
  for (const float value : {0.0f, 1.0f, 3.99f}) {
    HdrImage image = picture_of(value);
    add_bloom(image, {});
    EXPECT_EQ(image.rgba, picture_of(value).rgba);
  }
}

TEST(Bloom, SpreadsItsFractionOfALightAroundIt) {
  HdrImage image = picture_of(0);
  float* p = image.rgba.data() + 4 * (35 * 90 + 45);
  p[0] = 20;
  add_bloom(image, {});
  double red = 0, others = 0, alpha = 0;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    red += static_cast<double>(image.rgba[i]);
    others += static_cast<double>(image.rgba[i + 1] + image.rgba[i + 2]);
    alpha += static_cast<double>(image.rgba[i + 3]);
  }
  EXPECT_NEAR(red - 20, 0.12 * (20 - 4), 0.05 * 0.12 * 16);
  EXPECT_EQ(others, 0);
  EXPECT_EQ(alpha, 0);
  EXPECT_GT(image.rgba[4 * (35 * 90 + 48)], image.rgba[4 * (35 * 90 + 52)]);
}

std::vector<Point> puffs(int count) {
  std::vector<Point> values;
  for (int i = 0; i < count; ++i)
    values.push_back({.position = {0.5f * spread(i, 0.8192) - 0.25f, 2 + 0.5f * spread(i, 0.671),
                                   0.25f * static_cast<float>(i % 3)},
                      .velocity = {0, 1, 0},
                      .radius = 0.3f,
                      .color = {0.7f, 0.6f, 0.5f, 0.3f},
                      .id = static_cast<uint64_t>(i)});
  return values;
}

TEST(StageParticles, DoNotDependOnTheirOrderInTheSet) {
  for (const PointStyle style : {PointStyle::smoke, PointStyle::fire, PointStyle::streak}) {
    SmallStage s;
    s.stage.set_camera({.eye = {0, 2, 5}, .target = {0, 2, 0}});
    const PointsHandle points = s.stage.add_points({.style = style});
    std::vector<Point> values = puffs(60);
    s.stage.set_points(points, values);
    const HdrImage forwards = s.draw();
    std::reverse(values.begin(), values.end());
    s.stage.set_points(points, values);
    EXPECT_EQ(forwards.rgba, s.draw().rgba);
    EXPECT_GT(center_pixel(forwards).x(), 0.01f);
  }
}

TEST(StageParticles, SmokeCastsItsShadowAwayFromTheSun) {
  const Camera camera{.eye = {0, 12, 0.01f}, .target = {0, 0, 0}};
  SmallStage s(160, 120);
  s.stage.set_camera(camera);
  s.stage.set_sun({.direction = Vector3f(1, 1, 0).normalized()});
  s.add(make_ground(50), {.color = {0.8f, 0.8f, 0.8f, 1}, .roughness = 1});
  s.stage.set_points(s.stage.add_points({.style = PointStyle::smoke}), puffs(80));
  const HdrImage picture = s.draw();
  const auto floor_at = [&](float x) {
    const Vector2f place = project(camera, {x, 0, 0.2f}, 160, 120);
    return pixel(picture, static_cast<int>(place.x()), static_cast<int>(place.y())).y();
  };
  EXPECT_LT(floor_at(-2.2f), 0.5f * floor_at(4));
  EXPECT_GT(floor_at(-4.5f), 0.95f * floor_at(4));
}

}  // namespace
}  // namespace offstage::render
