#include <cmath>

#include "render/tone_map.h"
#include "tests/render/gl_fixture.h"

namespace offstage::render {
namespace {

const Environment kDark{.intensity = 0, .visible = false};
const Material kWhite{.color = {1, 1, 1, 1}, .roughness = 1};

// A white floor seen from above, under a dark sky and without sun.
struct Floor {
  explicit Floor(const Environment& environment = kDark, const Material& look = kWhite) : s(160, 120) {
    s.stage.set_environment(environment);
    s.stage.set_sun({.intensity = 0, .shadows = false});
    s.stage.set_camera(camera);
    s.add(make_ground(20), look);
  }
  float at(float x, float z, const SampleOffsets& offsets = {}) {
    const Vector2f place = project(camera, {x, 0, z}, 160, 120);
    return pixel(s.draw(offsets), static_cast<int>(place.x()), static_cast<int>(place.y())).y();
  }
  /// Returns the mean of 16 sub-frames and of five points along Z. The scene is drawn once, at the first
  /// call.
  float mean_at(float x, float z) {
    if (mean.rgba.empty())
      for (int i = 0; i < 16; ++i) s.stage.draw(sample_offsets(i, 16), mean);
    float sum = 0;
    for (int k = -2; k <= 2; ++k) {
      const Vector2f place = project(camera, {x, 0, z + 0.1f * static_cast<float>(k)}, 160, 120);
      sum += pixel(mean, static_cast<int>(place.x()), static_cast<int>(place.y())).y();
    }
    return sum / 80;
  }
  Camera camera{.eye = {0, 9, 0.01f}, .target = {0, 0, 0}};
  SmallStage s;
  HdrImage mean;
};

TEST(StageLight, OfALampFallsWithTheSquareOfTheDistance) {
  for (const float height : {1.0f, 2.0f, 4.0f}) {
    Floor floor;
    floor.s.stage.set_lamps(std::array{
        Lamp{.position = {0, height, 0}, .intensity = {3, 3, 3}, .radius = 0.01f, .shadows = false}});
    // As in sunlight, the Fresnel term removes 4 %, and the rough highlight adds about 1 %.
    EXPECT_NEAR(floor.at(0.02f, 0) * height * height, 3, 0.15);
  }
}

TEST(StageLight, OfAConeEndsAtItsEdge) {
  Floor floor;
  floor.s.stage.set_lamps(std::array{Lamp{
      .position = {0, 3, 0}, .intensity = {9, 9, 9}, .radius = 0.01f, .cone_deg = 60, .softness = 0.1f}});
  const float edge = 3 * std::tan(0.5236f);
  EXPECT_GT(floor.at(0.85f * edge, 0), 0.3f);
  EXPECT_EQ(floor.at(1.1f * edge, 0), 0);
}

TEST(StageLight, LampsCastShadowsWhereGeometryPredicts) {
  for (const float cone_deg : {0.0f, 100.0f}) {
    // A box of 0.5 m whose top is 1 m high, under a lamp at 3 m: the shadow of its top is 0.75 m wide. The
    // floor beside the shadow, and on the other sides of the lamp, is lit.
    Floor floor;
    floor.s.add(make_box({0.5f, 0.5f, 0.5f}), {.color = {0, 0, 0, 1}, .roughness = 1}, {1.2f, 0.75f, 0});
    floor.s.stage.set_lamps(std::array{Lamp{.position = {0, 3, 0},
                                            .intensity = {9, 9, 9},
                                            .radius = 0.01f,
                                            .cone_deg = cone_deg,
                                            .softness = 0.1f}});
    const float open = floor.at(-1.8f, 0);
    EXPECT_NEAR(floor.at(1.7f, 0), 0, 0.02 * open) << cone_deg;
    EXPECT_NEAR(floor.at(0, 1.8f) / open, 1, 0.03) << cone_deg;
    EXPECT_GT(floor.at(1.75f, 0.6f), 0.5f * open) << cone_deg;
  }
}

TEST(StageLight, SkyLightIsHiddenBesideABlackWall) {
  // A long black wall of height h: at distance x from its foot, it hides the fraction (1 - x / sqrt(x^2 +
  // h^2)) / 2 of the cosine-weighted sky. The highlight, 4 % of the light, is not hidden.
  Floor floor({.zenith = {1, 1, 1}, .horizon = {1, 1, 1}, .ground = {0, 0, 0}, .visible = false});
  floor.s.add(make_box({0.1f, 1, 30}), {.color = {0, 0, 0, 1}, .roughness = 1}, {-0.05f, 0.5f, 0});
  const auto visible = [](float x) { return 1 - 0.96f * 0.5f * (1 - x / std::sqrt(x * x + 1)); };
  const float open = floor.mean_at(6, 0) / visible(6);
  for (const float x : {0.5f, 1.0f, 2.0f}) EXPECT_NEAR(floor.mean_at(x, 0) / open, visible(x), 0.03f) << x;
}

TEST(StageLight, ShadowsAreSharperNearTheirCaster) {
  // A large sun at 45 degrees. A bar near the ground has a sharp shadow, a bar 2 m up a
  // soft one. The width of the shadow's edge is the distance that the light travels times the angular width
  // of the sun.
  const auto width_of_edge = [](float height) {
    Floor floor;
    floor.s.stage.set_sun({.direction = Vector3f(1, 1, 0).normalized(), .intensity = 3, .size_deg = 8});
    floor.s.add(make_box({0.05f, 0.1f, 3}), kWhite, {0, height, 0});
    const float open = floor.at(3, 0);
    int partial = 0;
    for (float x = -height - 0.6f; x < -height + 0.6f; x += 0.04f) {
      const float fraction = floor.mean_at(x, 0) / open;
      partial += fraction > 0.1f && fraction < 0.9f;
    }
    return partial;
  };
  EXPECT_GT(width_of_edge(2), 2 * width_of_edge(0.15f));
}

TEST(StageLight, GroundReflectsTheLightOfSunAndSky) {
  // The underside of a box above ground of albedo 0.5, under a uniform sky and the sun overhead.
  SmallStage s;
  s.stage.set_environment({.zenith = {1, 1, 1},
                           .horizon = {1, 1, 1},
                           .ground_albedo = Vector3f(0.5f, 0.5f, 0.5f),
                           .visible = false});
  s.stage.set_sun({.direction = {0, 1, 0}, .color = {1, 1, 1}, .intensity = 2, .shadows = false});
  s.stage.set_camera({.eye = {0, -5, 0.01f}, .target = {0, 0, 0}});
  s.add(make_box({3, 1, 3}), kWhite);
  EXPECT_NEAR(center_pixel(s.draw()).x(), 0.5f * (1 + 2), 0.1);
}

TEST(StageLight, GlassTintsTheObjectsBehindIt) {
  SmallStage s;
  s.stage.set_environment(kDark);
  s.stage.set_sun({.intensity = 0, .shadows = false});
  s.add(make_box({4, 4, 0.1f}), {.color = {0, 0, 0, 1}, .roughness = 1, .emission = {1, 1, 1}}, {0, 0, -1});
  s.add(make_box({2, 2, 0.05f}), {.color = {0.2f, 0.9f, 0.5f, 1}, .roughness = 0.05f, .transmission = 1},
        {0, 0, 1});
  const Vector4f seen = center_pixel(s.draw());
  const float fresnel = 0.96f;
  EXPECT_NEAR(seen.x(), 0.2f * fresnel, 0.02);
  EXPECT_NEAR(seen.y(), 0.9f * fresnel, 0.03);
  EXPECT_NEAR(seen.z(), 0.5f * fresnel, 0.02);
}

TEST(StageLight, MirrorsShowTheSceneWhereGeometryPredicts) {
  Camera camera{.eye = {0, 1.5f, 6}, .target = {0, 1, 0}};
  SmallStage s(192, 128);
  s.stage.set_environment(kDark);
  s.stage.set_sun({.intensity = 0, .shadows = false});
  s.stage.set_camera(camera);
  s.add(make_ground(20), {.color = {0.9f, 0.9f, 0.9f, 1}, .metallic = 1, .roughness = 0.02f});
  // A glowing square above the floor. Its reflection is seen where the line from the eye to the mirror image
  // meets the floor.
  s.add(make_box({1, 1, 0.05f}), {.color = {0, 0, 0, 1}, .roughness = 1, .emission = {1, 0.2f, 0}},
        {0, 1, 0});
  const HdrImage picture = s.draw();
  const auto mirrored = [&](float x, float y) {
    const Vector2f p = project(camera, {x, -y, 0}, 192, 128);
    return pixel(picture, static_cast<int>(p.x()), static_cast<int>(p.y()));
  };
  EXPECT_NEAR(mirrored(0, 1).x(), 0.9f, 0.06f);
  EXPECT_NEAR(mirrored(0, 1).y(), 0.18f, 0.03f);
  EXPECT_NEAR(mirrored(0.4f, 0.6f).x(), 0.9f, 0.06f);
  EXPECT_NEAR(mirrored(0.8f, 1).x(), 0, 0.02f) << "beside it";
  EXPECT_NEAR(mirrored(0, 0.3f).x(), 0, 0.02f) << "below it";
  // Objects outside the picture are mirrored too.
  s.stage.set_camera(camera = {.eye = {0, 1.5f, 6}, .target = {0, -0.7f, 0}, .fov_deg = 15});
  EXPECT_NEAR(pixel(s.draw(), 96, 64).x(), 0.9f, 0.06f);
}

TEST(StageLight, OfAFireIlluminatesItsSurroundings) {
  Floor floor;
  const PointsHandle flames = floor.s.stage.add_points({.style = PointStyle::fire});
  std::vector<Point> points;
  for (uint64_t k = 0; k < 20; ++k)
    points.push_back({.position = {0, 0.5f + 0.02f * static_cast<float>(k), 0},
                      .velocity = {0, 1, 0},
                      .radius = 0.15f,
                      .color = {6, 3, 1, 1},
                      .id = k});
  EXPECT_EQ(floor.at(1.5f, 0), 0);
  floor.s.stage.set_points(flames, points);
  const float near = floor.at(1.5f, 0), far = floor.at(3, 0);
  EXPECT_GT(near, 0.01f);
  EXPECT_GT(near, 3 * far);
}

TEST(ToneMap, MeteringBringsEveryEvenPictureToTheSameGrey) {
  for (const float light : {0.05f, 0.5f, 4.0f}) {
    HdrImage picture{30, 20, {}};
    for (int k = 0; k < 600; ++k)
      picture.rgba.insert(picture.rgba.end(), {2 * light, 2 * light, 2 * light, 2});
    EXPECT_NEAR(metered_exposure(picture, 0.5f) * light, 0.5f, 1e-3f);
  }
}

}  // namespace
}  // namespace offstage::render
