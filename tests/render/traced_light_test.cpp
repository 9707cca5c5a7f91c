// Traced light against closed forms.

#include <cmath>
#include <numbers>

#include <tbb/task_arena.h>

#include "tests/render/gl_fixture.h"

namespace offstage::render {
namespace {

const Environment kNoLight{.intensity = 0, .visible = false};
const Material kPlaster{.color = {1, 1, 1, 1}, .roughness = 1};
const Material kGrey{.color = {0.6f, 0.6f, 0.6f, 1}, .roughness = 1};

Environment even_sky(float radiance) {
  const Vector3f all = Vector3f::Constant(radiance);
  return {.zenith = all, .horizon = all, .ground = all};
}

/// Returns the mean of n sub-frames.
HdrImage mean_of(SmallStage& s, int n) {
  HdrImage sum;
  for (int i = 0; i < n; ++i) s.stage.draw(sample_offsets(i, n), sum);
  for (float& value : sum.rgba) value /= static_cast<float>(n);
  return sum;
}

/// Returns the mean of a square of pixels around a point.
float mean_around(const HdrImage& picture, const Vector2f& place, int half) {
  float sum = 0;
  for (int dy = -half; dy <= half; ++dy)
    for (int dx = -half; dx <= half; ++dx)
      sum += pixel(picture, static_cast<int>(place.x()) + dx, static_cast<int>(place.y()) + dy).y();
  return sum / static_cast<float>((2 * half + 1) * (2 * half + 1));
}

/// Returns the root mean square of picture - reference relative to that of the reference, over the pixels
/// from area.min() up to area.max(), exclusive.
float relative_error(const HdrImage& picture, const HdrImage& reference, const Eigen::AlignedBox2i& area) {
  float error2 = 0, sum2 = 0;
  for (int y = area.min().y(); y < area.max().y(); ++y)
    for (int x = area.min().x(); x < area.max().x(); ++x) {
      const float light = pixel(reference, x, y).y(), off = pixel(picture, x, y).y() - light;
      error2 += off * off;
      sum2 += light * light;
    }
  EXPECT_GT(sum2, 1);  // something is visible
  return std::sqrt(error2 / sum2);
}

struct TracedLight : testing::Test {
  TracedLight() : s(160, 120) {
    s.stage.set_environment(kNoLight);
    s.stage.set_sun({.intensity = 0, .shadows = false});
  }
  void look(const Camera& value) {
    camera = value;
    s.stage.set_camera(value);
  }
  Vector2f place_of(const Vector3f& point) const { return project(camera, point, 160, 120); }
  Camera camera;
  SmallStage s;
};

// The furnace: a white ball in an even sky sends as much light to the eye as the sky behind it.
TEST_F(TracedLight, AWhiteBallVanishesInAnEvenSky) {
  s.stage.set_environment(even_sky(0.7f));
  s.add(make_sphere(1), kPlaster);
  look({.eye = {0, 0, 4}, .target = {0, 0, 0}});
  const HdrImage picture = mean_of(s, 4);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) EXPECT_NEAR(pixel(picture, x, y).y(), 0.7f, 0.007f) << x << ", " << y;
}

// In a closed room whose walls glow with e and reflect a fraction r, the radiance is e + r e + r^2 e + ... =
// e / (1 - r) everywhere. (A rough dielectric reflects a little more than its colour, as in sunlight.)
TEST_F(TracedLight, InAGlowingRoomIsTheSumOfAllReflections) {
  for (const float fraction : {0.2f, 0.5f, 0.8f}) {
    SmallStage room(96, 64);
    room.stage.set_environment(kNoLight);
    room.stage.set_sun({.intensity = 0, .shadows = false});
    room.stage.set_camera({.eye = {0.2f, 0.1f, 0.4f}, .target = {1, 0.3f, 0}});
    room.add(make_box({4, 3, 5}), {.color = {fraction, fraction, fraction, 1},
                                   .roughness = 1,
                                   .emission = Vector3f::Constant(0.3f),
                                   .two_sided = true});
    const HdrImage picture = mean_of(room, 16);
    EXPECT_NEAR(mean_around(picture, {48, 32}, 25) * (1 - fraction) / 0.3f, 1, 0.03f) << fraction;
  }
}

// A disc of radius R at height h over a floor: the form factor of the floor below its middle is
// R^2 / (R^2 + h^2).
TEST_F(TracedLight, OfAGlowingDiscFollowsItsFormFactor) {
  const float radius = 1;
  for (const float height : {0.5f, 1.0f, 3.0f}) {
    SmallStage scene(160, 120);
    scene.stage.set_environment(kNoLight);
    scene.stage.set_sun({.intensity = 0, .shadows = false});
    const Camera low{.eye = {2.5f, 0.4f * height, 0}, .target = {0, 0, 0}, .fov_deg = 20};
    scene.stage.set_camera(low);
    scene.add(make_ground(20), kPlaster);
    scene.add(make_cylinder(radius, 0.01f, 96),
              {.color = {0, 0, 0, 1}, .roughness = 1, .emission = {2, 2, 2}}, {0, height + 0.005f, 0});
    const HdrImage picture = mean_of(scene, 64);
    const float expected = 2 * radius * radius / (radius * radius + height * height);
    EXPECT_NEAR(mean_around(picture, project(low, {0, 0, 0}, 160, 120), 3) / expected, 1, 0.05f) << height;
  }
}

// Small and bright: rays in random directions would hardly ever meet it. A ball of radius r at distance d
// lights a white surface that faces it with the fraction r^2 / d^2 of its radiance; a small face of area A
// with A / (pi d^2). One sub-frame already shows it without noise, and halves of the floor agree.
TEST_F(TracedLight, OfASmallGlowingMeshHasNoNoise) {
  const float radius = 0.04f, height = 2, radiance = 500;
  const Material glow{
      .color = {0, 0, 0, 1}, .roughness = 1, .emission = Vector3f::Constant(radiance), .two_sided = true};
  struct Case {
    Mesh mesh;
    float fraction;
  };
  const float side = 0.08f;
  for (const Case& c :
       {Case{make_sphere(radius, 48), radius * radius / (height * height)},
        Case{make_box({side, 1e-3f, side}), side * side / (std::numbers::pi_v<float> * height * height)}}) {
    SmallStage scene(160, 120);
    scene.stage.set_environment(kNoLight);
    scene.stage.set_sun({.intensity = 0, .shadows = false});
    const Camera low{.eye = {0.5f, 0.7f, 0}, .target = {0, 0, 0}, .fov_deg = 20};
    scene.stage.set_camera(low);
    scene.add(make_ground(20), kPlaster);
    scene.add(c.mesh, glow, {0, height, 0});
    const HdrImage picture = mean_of(scene, 16);
    const Vector2f below = project(low, {0, 0, 0}, 160, 120);
    const float middle = mean_around(picture, below, 4);
    EXPECT_NEAR(middle / (radiance * c.fraction), 1, 0.05f);
    for (int dx = -4; dx <= 4; ++dx)
      EXPECT_NEAR(pixel(picture, static_cast<int>(below.x()) + dx, static_cast<int>(below.y())).y() / middle,
                  1, 0.1f);
    scene.add(make_box({0.5f, 0.01f, 0.5f}), {.color = {0, 0, 0, 1}, .roughness = 1},
              {0, 0.5f * height, 0});  // an obstacle between light and floor
    EXPECT_LT(mean_around(mean_of(scene, 4), below, 4), 0.03f * middle);
  }
}

// A sprite, smoke and a pane of which one half is behind a wall, as the lamp and the sun see them.
TEST_F(TracedLight, ReachesParticlesAndPanesOnlyWhereNothingIsInTheWay) {
  s.add(make_box({2, 2, 0.01f}), kPlaster, {-1, 0, 2});  // before the left half, out of the picture's way
  look({.eye = {0, 6, 0.01f}, .target = {0, 0, 0}, .fov_deg = 40});
  const auto brightness = [&] {
    const HdrImage picture = mean_of(s, 4);
    return std::array{mean_around(picture, place_of({-0.8f, 0, 0}), 2),
                      mean_around(picture, place_of({0.8f, 0, 0}), 2)};
  };
  const auto expect_half_lit = [&](const char* what) {
    const std::array light = brightness();
    EXPECT_GT(light[1], 0.01f) << what;
    EXPECT_LT(light[0], 0.35f * light[1]) << what;  // a cloud scatters some light into shadow
  };
  const auto with_each_light = [&](const char* what) {
    s.stage.set_sun({.direction = {0, 0, 1}, .intensity = 2});
    expect_half_lit(what);
    s.stage.set_sun({.intensity = 0, .shadows = false});
    s.stage.set_lamps(std::array{Lamp{.position = {0, 0, 60}, .intensity = Vector3f::Constant(9e3f)}});
    expect_half_lit(what);
    s.stage.set_lamps({});
  };
  for (const PointStyle style : {PointStyle::sprite, PointStyle::flake, PointStyle::smoke}) {
    const PointsHandle points = s.stage.add_points({.style = style, .casts_shadow = false});
    Point left{
        .position = {-0.8f, 0, 0}, .velocity = {0, 0, 0}, .radius = 0.2f, .color = {1, 1, 1, 1}, .id = 1};
    Point right = left;
    right.position.x() = 0.8f;
    right.id = 2;
    s.stage.set_points(points, std::array{left, right});
    with_each_light(style == PointStyle::sprite ? "sprite" : style == PointStyle::flake ? "flake" : "smoke");
    s.stage.remove(points);
  }
  s.add(make_box({4, 0.3f, 0.3f}), {.color = {1, 1, 1, 0.7f}, .roughness = 1});
  s.stage.set_sun({.direction = Vector3f(0, 0.3f, 1).normalized(), .intensity = 2});
  expect_half_lit("pane");
}

// A ball with refractive index 3/2 focuses parallel light at 3/2 of its radius behind its centre.
TEST_F(TracedLight, OfTheSunIsFocusedByABallOfGlass) {
  const Material clear{.color = {1, 1, 1, 1}, .roughness = 0, .transmission = 1};
  s.stage.set_sun({.direction = {0, 1, 0}, .color = {1, 1, 1}, .intensity = 1, .size_deg = 0.5f});
  s.add(make_ground(20), {.color = {0.5f, 0.5f, 0.5f, 1}, .roughness = 1});
  look({.eye = {2, 1.2f, 0}, .target = {0, 0, 0}, .fov_deg = 30});
  const auto light_at = [&](float x) { return mean_around(mean_of(s, 4), place_of({x, 0, 0}), 1); };
  const float open = light_at(0);
  const InstanceHandle ball = s.add(make_sphere(0.3f), clear, {0, 0.45f, 0});
  EXPECT_GT(light_at(0), 5 * open);
  EXPECT_LT(light_at(0.2f), 0.3f * open);  // in the shadow of the ball

  // From far above the floor, a ball spreads the light over a wide area. No light is lost except the part
  // that its surfaces reflect.
  s.stage.remove(ball);
  look({.eye = {0, 2.1f, 0.001f}, .target = {0, 0, 0}, .fov_deg = 140});  // each pixel shows the same area
  const auto sum = [&] {
    const HdrImage picture = mean_of(s, 4);
    float result = 0;
    for (int y = 0; y < 120; ++y)
      for (int x = 0; x < 160; ++x) result += pixel(picture, x, y).y();
    return result;
  };
  const float without = sum(), pixel_m = 2 * 2.1f * std::tan(70 * std::numbers::pi_v<float> / 180) / 120;
  const float met = without / (160 * 120) * std::numbers::pi_v<float> * 0.09f / (pixel_m * pixel_m);
  s.add(make_sphere(0.3f), clear, {0, 2.5f, 0});
  const float lost = (without - sum()) / met;
  EXPECT_GT(lost, 0.05f);
  EXPECT_LT(lost, 0.25f);
}

// Photons end at opaque surfaces only. Panes behind glass are lit straight through it, and not dark.
TEST_F(TracedLight, ReachesPanesBehindGlass) {
  s.add(make_box({4, 0.05f, 4}), {.color = {1, 1, 1, 0.6f}, .roughness = 1});
  look({.eye = {0, 1.5f, 3}, .target = {0, 0, 0}, .fov_deg = 40});
  const auto brightness = [&] { return mean_around(mean_of(s, 4), place_of({0, 0, 0}), 3); };
  s.stage.set_sun({.direction = {0, 1, 0}, .intensity = 2});
  const float by_sun = brightness();
  s.stage.set_sun({.intensity = 0, .shadows = false});
  const std::array lamp = {Lamp{.position = {0, 9, 0}, .intensity = Vector3f::Constant(100)}};
  s.stage.set_lamps(lamp);
  const float by_lamp = brightness();
  s.add(make_box({2, 0.2f, 2}), {.color = {1, 1, 1, 1}, .roughness = 0, .transmission = 1}, {0, 2.5f, 0});
  EXPECT_NEAR(brightness() / by_lamp, 0.9f, 0.15f);
  s.stage.set_lamps({});
  s.stage.set_sun({.direction = {0, 1, 0}, .intensity = 2});
  EXPECT_NEAR(brightness() / by_sun, 0.9f, 0.15f);
}

// The sun passes both faces of a black plate of opacity a: a fraction (1 - a)^2 of its light reaches the
// floor.
TEST_F(TracedLight, OfTheSunIsDimmedByTranslucentPlates) {
  s.stage.set_sun({.direction = {0, 1, 0}, .intensity = 2, .size_deg = 0.5f});
  s.add(make_ground(20), kPlaster);
  look({.eye = {0, 1, 3}, .target = {0, 0, 0}, .fov_deg = 20});
  const auto brightness = [&] { return mean_around(mean_of(s, 4), place_of({0, 0, 0}), 3); };
  const float without = brightness();
  s.add(make_box({2, 0.1f, 2}), {.color = {0, 0, 0, 0.4f}, .roughness = 1}, {0, 2.5f, 0});
  EXPECT_NEAR(brightness() / without, 0.6f * 0.6f, 0.01f);
}

// A room that only a small sunlit patch of its floor lights. Rays seldom find the patch, so its walls get
// further paths.
TEST_F(TracedLight, OfASmallBrightPatchHasLittleNoise) {
  constexpr float kHole = 0.15f, kWall = 0.1f, kBeside = (1 - kHole) / 2;
  const auto wall = [&](const Vector3f& size, const Vector3f& center) {
    s.add(make_box(size), kGrey, center);
  };
  for (const float side : {-1.0f, 1.0f}) {
    wall({kWall, 2.2f, 2.2f}, {side, 0, 0});
    wall({2.2f, 2.2f, kWall}, {0, 0, 1.2f * side});
    wall({2.2f, kWall, kBeside * 2}, {0, 1, side * (kHole + kBeside)});  // the ceiling around a hole
    wall({kBeside * 2, kWall, 2.2f}, {side * (kHole + kBeside), 1, 0});
  }
  wall({2.2f, kWall, 2.4f}, {0, -1, 0});
  s.stage.set_sun({.direction = {0, 1, 0}, .color = {1, 1, 1}, .intensity = 30, .size_deg = 0.5f});
  look({.eye = {0.3f, 0.2f, 1}, .target = {-0.3f, 0.1f, -1}, .fov_deg = 70});
  const HdrImage picture = mean_of(s, 4), reference = mean_of(s, 64);
  EXPECT_LT(relative_error(picture, reference, {Eigen::Vector2i(10, 10), Eigen::Vector2i(150, 80)}),
            0.25f);  // 0.16; without the further paths 0.41
}

// The penumbra of a wide lamp, on a floor with a highlight. Pixels in penumbras get further shadow rays, and
// the highlights of rough surfaces are filtered.
TEST_F(TracedLight, OfPenumbrasHasLittleNoise) {
  s.add(make_ground(20), {.color = {0.5f, 0.5f, 0.5f, 1}, .roughness = 0.6f});
  s.add(make_box({0.1f, 1, 4}), kGrey, {-1, 1, 0});
  s.stage.set_lamps(std::array{Lamp{.position = {-3, 3, 0},
                                    .intensity = {9, 9, 9},
                                    .size = {2, 2},
                                    .direction = Vector3f(1, -1, 0).normalized()}});
  look({.eye = {2, 1.5f, 0}, .target = {0, 0, 0}, .fov_deg = 40});
  const HdrImage picture = mean_of(s, 4), reference = mean_of(s, 64);
  EXPECT_LT(relative_error(picture, reference, {Eigen::Vector2i(20, 10), Eigen::Vector2i(140, 80)}),
            0.022f);  // 0.017; without them 0.034
}

// A metal mirror shows a wall behind the camera, which is in shadow and lit by a sunlit floor of bright and
// dark strips. Mirror images are not filtered, so each has several paths from the wall.
TEST_F(TracedLight, OfWallsInMirrorsHasLittleNoise) {
  s.stage.set_sun({.direction = {0, 1, 0}, .intensity = 3, .size_deg = 0.5f});
  for (int i = -6; i < 6; ++i)
    s.add(make_box({12, 0.1f, 0.5f}),
          {.color = i % 2 == 0 ? Vector4f(0.9f, 0.9f, 0.9f, 1) : Vector4f(0.05f, 0.05f, 0.05f, 1),
           .roughness = 1},
          {0, -1.05f, static_cast<float>(i) + 0.5f});
  s.add(make_box({12, 4, 0.1f}), kPlaster, {0, 1, 5});
  s.add(make_box({4, 2, 0.1f}), {.color = {1, 1, 1, 1}, .metallic = 1, .roughness = 0}, {0, 0, -2});
  look({.eye = {0, 0.2f, 1}, .target = {0, 0.2f, -2}, .fov_deg = 20});
  const HdrImage picture = mean_of(s, 4), reference = mean_of(s, 64);
  EXPECT_LT(relative_error(picture, reference, {Eigen::Vector2i(20, 20), Eigen::Vector2i(140, 60)}),
            0.8f);  // 0.63; with one path per pixel 1.3
}

// The rim of a glass ball shows walls beside and behind the camera, and reflects between a tenth and all of
// the light inside. Both parts are followed, and several paths leave the walls.
TEST_F(TracedLight, BehindTheRimOfAGlassBallHasLittleNoise) {
  for (const float side : {-1.0f, 1.0f}) {
    s.add(make_box({0.1f, 4, 12}), kGrey, {4 * side, 0, 0});
    s.add(make_box({8, 4, 0.1f}), kGrey, {0, 0, 6 * side});
  }
  s.add(make_box({8, 0.1f, 12}), kGrey, {0, -1.5f, 0});
  s.add(make_sphere(1), {.color = {1, 1, 1, 1}, .roughness = 0, .transmission = 1});
  s.stage.set_environment(even_sky(0.3f));
  s.stage.set_lamps(std::array{Lamp{.position = {-2, 3, 2}, .intensity = {20, 20, 20}, .radius = 0.3f}});
  look({.eye = {0, 0.3f, 4}, .target = {0, 0, 0}, .fov_deg = 32});
  const HdrImage picture = mean_of(s, 4), reference = mean_of(s, 64);
  EXPECT_LT(relative_error(picture, reference, {Eigen::Vector2i(124, 46), Eigen::Vector2i(136, 88)}),
            0.25f);  // 0.18; with one path 0.35
}

// The indirect light of what a mirror shows is filtered as that of what is directly visible.
TEST_F(TracedLight, ALampLitRoomHasLittleNoiseInAMirror) {
  for (const float side : {-1.0f, 1.0f}) {
    s.add(make_box({0.1f, 4, 8}), kGrey, {2 * side, 0, 0});
    s.add(make_box({4, 0.1f, 8}), kGrey, {0, 1.5f * side, 0});
    s.add(make_box({4, 4, 0.1f}), kGrey, {0, 0, 4 * side});
  }
  s.add(make_sphere(0.5f), kGrey, {0.8f, -1, -1});
  s.add(make_box({2, 1.6f, 0.04f}), {.color = {1, 1, 1, 1}, .metallic = 1, .roughness = 0}, {0, 0, -3.9f});
  std::vector<Lamp> lamps;
  for (const float x : {-1.0f, 0.0f, 1.0f})
    lamps.push_back({.position = {x, 1.2f, 0.5f}, .intensity = {2, 2, 2}, .radius = 0.1f});
  s.stage.set_lamps(lamps);
  look({.eye = {0, 0, 2}, .target = {0, 0, -4}, .fov_deg = 50});
  const HdrImage picture = mean_of(s, 4), reference = mean_of(s, 64);
  EXPECT_LT(relative_error(picture, reference, {Eigen::Vector2i(64, 50), Eigen::Vector2i(96, 74)}),
            0.1f);  // 0.06; without filter 0.35
}

TEST_F(TracedLight, FrostedGlassHasLittleNoise) {
  s.add(make_box({12, 12, 0.1f}), kGrey, {0, 0, -2});
  s.add(make_sphere(0.4f), {.color = {0.02f, 0.02f, 0.02f, 1}, .roughness = 1}, {0.3f, 0, -1});
  s.add(make_box({2, 2, 0.05f}), {.color = {1, 1, 1, 1}, .roughness = 0.35f, .transmission = 1});
  s.stage.set_environment(even_sky(0.3f));
  s.stage.set_lamps(std::array{Lamp{.position = {-2, 3, 2}, .intensity = {20, 20, 20}, .radius = 0.3f}});
  look({.eye = {0, 0.3f, 4}, .target = {0, 0, 0}, .fov_deg = 32});
  const HdrImage picture = mean_of(s, 4), reference = mean_of(s, 64);
  EXPECT_LT(relative_error(picture, reference, {Eigen::Vector2i(60, 40), Eigen::Vector2i(110, 80)}), 0.1f);
}

// The furnace for particles: inside a closed ball, they have the light of its wall, whatever the sky outside.
TEST_F(TracedLight, ParticlesIndoorsHaveTheLightOfTheWalls) {
  Environment sky = even_sky(2);
  sky.visible = false;  // the sky is also not visible through the particle
  s.stage.set_environment(sky);
  look({.eye = {0, 0, 1.5f}, .target = {0, 0, 0}, .fov_deg = 40});
  const auto brightness = [&](PointStyle style, float wall) {
    const InstanceHandle room =
        s.add(make_sphere(2), {.color = {0, 0, 0, 1}, .roughness = 1, .emission = Vector3f::Constant(wall)});
    const PointsHandle points = s.stage.add_points({.style = style, .softness = 0.1f});
    s.stage.set_points(
        points,
        std::array{Point{
            .position = {0, 0, 0}, .velocity = {0, 0, 0}, .radius = 0.3f, .color = {1, 1, 1, 1}, .id = 1}});
    const float result = mean_around(mean_of(s, 4), {80, 60}, 2);
    s.stage.remove(points);
    s.stage.remove(room);
    return result;
  };
  for (const PointStyle style : {PointStyle::sprite, PointStyle::flake, PointStyle::smoke}) {
    EXPECT_NEAR(brightness(style, 0.5f), 0.5f, 0.05f) << static_cast<int>(style);
    EXPECT_NEAR(brightness(style, 0), 0, 0.01f) << static_cast<int>(style);
  }
  EXPECT_NEAR(brightness(PointStyle::streak, 0), 0, 0.01f);  // drops, which are streaks, mirror the sky
}

// A wide screen with a straight edge at height h, and the sun overhead, whose disc has the radius w = h
// tan(s) on the floor: at distance x from the edge's shadow, a segment of the disc is visible, with the
// fraction 1/2 + (u sqrt(1 - u^2) + asin u) / pi, u = x / w.
TEST_F(TracedLight, PenumbraOfTheSunIsTheVisiblePartOfItsDisc) {
  const float height = 2, size_deg = 12;
  const float width = height * std::tan(0.5f * size_deg * std::numbers::pi_v<float> / 180);
  s.stage.set_sun({.direction = {0, 1, 0}, .color = {1, 1, 1}, .intensity = 1, .size_deg = size_deg});
  s.add(make_ground(20), {.color = {0.5f, 0.5f, 0.5f, 1}, .roughness = 1});
  s.add(make_box({4, 0.01f, 8}), {.color = {0, 0, 0, 1}, .roughness = 1}, {-2, height, 0});
  look({.eye = {0.4f, 1.2f, 0.01f}, .target = {0, 0, 0}, .fov_deg = 50});
  const HdrImage picture = mean_of(s, 64);
  const float open = mean_around(picture, place_of({2 * width, 0, 0}), 1);
  for (const float u : {-0.8f, -0.4f, 0.0f, 0.4f, 0.8f}) {
    const float visible = 0.5f + (u * std::sqrt(1 - u * u) + std::asin(u)) / std::numbers::pi_v<float>;
    EXPECT_NEAR(mean_around(picture, place_of({u * width, 0, 0}), 1) / open, visible, 0.03f) << u;
  }
}

TEST_F(TracedLight, OfTwelveLampsIsTheSumOfAll) {
  s.add(make_ground(20), kPlaster);
  look({.eye = {0, 9, 0.01f}, .target = {0, 0, 0}});
  std::vector<Lamp> lamps;
  for (int k = 0; k < 12; ++k) {
    const float angle = 0.5236f * static_cast<float>(k);
    lamps.push_back({.position = {2 * std::cos(angle), 1.5f, 2 * std::sin(angle)},
                     .intensity = {1, 1, 1},
                     .radius = 0.05f});
  }
  s.stage.set_lamps(std::array{lamps[0], lamps[6]});  // opposite each other
  const float one = 0.5f * mean_around(mean_of(s, 4), place_of({0, 0, 0}), 1);
  s.stage.set_lamps(lamps);
  EXPECT_NEAR(mean_around(mean_of(s, 4), place_of({0, 0, 0}), 1) / one, 12, 0.1f);
}

TEST_F(TracedLight, ABrightWallColoursTheFloorBesideIt) {
  s.stage.set_environment(even_sky(0.2f));
  s.stage.set_sun({.direction = Vector3f(1, 1, 0).normalized(), .intensity = 3});
  s.add(make_ground(20), kPlaster);
  s.add(make_box({0.2f, 2, 6}), {.color = {0.9f, 0.1f, 0.05f, 1}, .roughness = 1}, {-0.1f, 1, 0});
  look({.eye = {2, 3, 4}, .target = {0.5f, 0, 0}});
  const HdrImage picture = mean_of(s, 4);
  const auto redness = [&](float x) {
    const Vector2f p = place_of({x, 0, 0});
    const Vector4f c = pixel(picture, static_cast<int>(p.x()), static_cast<int>(p.y()));
    return c.x() / c.z();
  };
  EXPECT_GT(redness(0.15f), 1.1f * redness(1.9f));
}

// The front of a clear pane mirrors 0.04 of the light. What the back mirrors is added to the refracted light.
TEST_F(TracedLight, GlassLetsATransparentBackgroundThrough) {
  const Material clear{.color = {1, 1, 1, 1}, .roughness = 0, .transmission = 1};
  s.add(make_box({2, 2, 0.1f}), clear);
  look({.eye = {0, 0, 4}, .target = {0, 0, 0}});
  EXPECT_NEAR(center_pixel(s.draw()).w(), 0.04f, 0.002f);
  s.add(make_box({3, 3, 0.1f}), kPlaster, {0, 0, -2});
  EXPECT_EQ(center_pixel(s.draw()).w(), 1);
}

TEST_F(TracedLight, MirrorsShowObjectsBehindTheCamera) {
  s.add(make_box({2, 2, 0.1f}), {.color = {0.9f, 0.9f, 0.9f, 1}, .metallic = 1, .roughness = 0.01f});
  s.add(make_box({3, 3, 0.1f}), {.color = {0, 0, 0, 1}, .roughness = 1, .emission = {1, 0.5f, 0}}, {0, 0, 8});
  look({.eye = {0, 0, 4}, .target = {0, 0, 0}});
  const Vector4f seen = center_pixel(s.draw());
  EXPECT_NEAR(seen.x(), 0.9f, 0.03f);
  EXPECT_NEAR(seen.y(), 0.45f, 0.02f);
}

// In front of an even sky, the middle of a particle with opacity a and radiance c has a c + (1 - a) sky, or
// sky + a c if it adds light. A white lit particle vanishes (furnace).
TEST_F(TracedLight, MirrorsShowParticlesBehindTheCamera) {
  constexpr float kSky = 0.4f, kReflected = 0.9f;
  s.stage.set_environment(even_sky(kSky));
  s.add(make_box({2, 2, 0.1f}),
        {.color = {kReflected, kReflected, kReflected, 1}, .metallic = 1, .roughness = 0.01f});
  look({.eye = {0, 0, 4}, .target = {0, 0, 0}});
  const auto seen = [&](const PointsDef& def, float opacity) {
    const PointsHandle points = s.stage.add_points(def);
    s.stage.set_points(points, std::array{Point{.position = {0, 0, 8},
                                                .velocity = {0, 600, 0},
                                                .radius = 2,
                                                .color = {1, 1, 1, opacity},
                                                .id = 1}});
    const float result = mean_around(mean_of(s, 4), {80, 60}, 1);
    s.stage.remove(points);
    return result / kReflected;
  };
  for (const PointStyle style :
       {PointStyle::sprite, PointStyle::flake, PointStyle::streak, PointStyle::smoke}) {
    SCOPED_TRACE(static_cast<int>(style));
    EXPECT_NEAR(seen({.style = style, .lit = false, .softness = 0.1f}, 1), 1, 0.03f);
    EXPECT_NEAR(seen({.style = style, .lit = false, .softness = 0.1f}, 0.5f), 0.5f + 0.5f * kSky, 0.03f);
    EXPECT_NEAR(seen({.style = style, .additive = true, .lit = false, .softness = 0.1f}, 0.5f), 0.5f + kSky,
                0.03f);
    EXPECT_NEAR(seen({.style = style, .softness = 0.1f}, 1), kSky, 0.03f);
  }
}

// Flames look in a mirror as they do from the same distance. A highlight of their light would be added to
// them.
TEST_F(TracedLight, MirrorsShowFlamesWithoutAHighlight) {
  const PointsHandle points = s.stage.add_points({.style = PointStyle::fire});
  s.stage.set_points(
      points,
      std::array{
          Point{.position = {0, 0, 8}, .velocity = {0, 1, 0}, .radius = 1, .color = {1, 1, 1, 1}, .id = 1}});
  const auto seen = [&](const Camera& from) {
    look(from);
    return mean_around(mean_of(s, 4), {80, 60}, 12);
  };
  const float direct = seen({.eye = {0, 0, -4}, .target = {0, 0, 0}});
  s.add(make_box({2, 2, 0.1f}), {.color = {1, 1, 1, 1}, .metallic = 1, .roughness = 0.01f});
  EXPECT_NEAR(seen({.eye = {0, 0, 4}, .target = {0, 0, 0}}) / direct, 1, 0.25f);
}

// In a closed room of metal that glows with e and reflects a fraction r, the radiance is e / (1 - r). Seen at
// a right angle, since metal reflects more at grazing angles.
TEST_F(TracedLight, InAGlowingRoomOfMirrorsIsTheSumOfAllReflections) {
  for (const float fraction : {0.3f, 0.6f}) {
    SmallStage room(96, 64);
    room.stage.set_environment(kNoLight);
    room.stage.set_sun({.intensity = 0, .shadows = false});
    room.stage.set_camera({.eye = {0.2f, 0.1f, 0.4f}, .target = {2, 0.1f, 0.4f}, .fov_deg = 10});
    room.add(make_box({4, 3, 5}), {.color = {fraction, fraction, fraction, 1},
                                   .metallic = 1,
                                   .roughness = 0.01f,
                                   .emission = Vector3f::Constant(0.3f),
                                   .two_sided = true});
    EXPECT_NEAR(mean_around(mean_of(room, 4), {48, 32}, 25) * (1 - fraction) / 0.3f, 1, 0.02f) << fraction;
  }
}

TEST_F(TracedLight, MirrorsShowSurfacesThatALampLights) {
  s.stage.set_lamps(std::array{Lamp{.position = {0, 2, 3}, .intensity = {4, 4, 4}, .radius = 0.05f}});
  s.add(make_ground(20), {.color = {0.5f, 0.5f, 0.5f, 1}, .roughness = 1});
  s.add(make_box({4, 4, 0.1f}), {.color = {1, 1, 1, 1}, .metallic = 1, .roughness = 0.01f}, {0, 2, -0.05f});
  look({.eye = {0, 1, 4}, .target = {0, 0.3f, 0}});
  const HdrImage picture = mean_of(s, 8);
  // A point of the floor and its mirror image, which is seen in the plane z = 0.
  const float seen = mean_around(picture, place_of({0.3f, 0, 0.8f}), 1);
  EXPECT_NEAR(mean_around(picture, place_of({0.3f, 0, -0.8f}), 1) / seen, 1, 0.05f);
}

// A glossy plate behind the camera, seen in a mirror, and seen from the place behind the mirror that the
// image has as its eye.
TEST_F(TracedLight, MirrorsShowHighlights) {
  for (const Material& glossy : {Material{.color = {0.9f, 0.5f, 0.2f, 1}, .metallic = 1, .roughness = 0.4f},
                                 Material{.color = {0.9f, 0.5f, 0.2f, 1}, .metallic = 1, .roughness = 0.3f},
                                 Material{.color = {0.2f, 0.2f, 0.2f, 1}, .roughness = 0.4f}}) {
    std::array<float, 2> seen{};
    for (const bool in_mirror : {false, true}) {
      SmallStage scene(160, 120);
      scene.stage.set_environment(kNoLight);
      scene.stage.set_sun({.intensity = 0, .shadows = false});
      scene.stage.set_lamps(std::array{Lamp{.position = {-5, 0, 6}, .intensity = {2, 2, 2}, .radius = 0.1f}});
      scene.add(make_box({12, 4, 0.1f}), glossy, {-4, 0, 8.05f});
      if (in_mirror)
        scene.add(make_box({1, 1, 0.1f}), {.color = {1, 1, 1, 1}, .metallic = 1, .roughness = 0},
                  {0, 0, -0.05f});
      scene.stage.set_camera({.eye = {2, 0, in_mirror ? 4.0f : -4.0f}, .target = {0, 0, 0}, .fov_deg = 30});
      seen[in_mirror] = mean_around(mean_of(scene, 4), {80, 60}, 12);
    }
    EXPECT_NEAR(seen[1] / seen[0], 1, 0.12f) << glossy.metallic << " " << glossy.roughness;
  }
}

// The mirror image of a lamp has the radiance of the lamp, without noise: pi times the intensity per visible
// area.
TEST_F(TracedLight, MirrorsShowLampsWithTheirRadianceAndShape) {
  look({.eye = {0, 0, 4}, .target = {0, 0, 0}, .fov_deg = 20});
  const Lamp square{
      .position = {0, 0, 6}, .intensity = {2, 2, 2}, .size = {0.8f, 0.8f}, .direction = {0, 0, -1}};
  const Lamp ball{.position = {0, 0, 6}, .intensity = {2, 2, 2}, .radius = 0.4f};
  const Vector2f middle = place_of({0, 0, -6}), inside = place_of({0.32f, 0.32f, -6}),
                 outside = place_of({0.5f, 0.5f, -6});
  for (const float roughness : {0.0f, 0.03f}) {
    const InstanceHandle mirror =
        s.add(make_box({6, 6, 0.1f}), {.color = {1, 1, 1, 1}, .metallic = 1, .roughness = roughness},
              {0, 0, -0.05f});
    for (const Lamp& lamp : {square, ball}) {
      s.stage.set_lamps(std::array{lamp});
      const float area =
          lamp.size.x() > 0 ? lamp.size.prod() : std::numbers::pi_v<float> * lamp.radius * lamp.radius;
      const float radiance = std::numbers::pi_v<float> * lamp.intensity.y() / area;
      const HdrImage picture = mean_of(s, 4);
      for (const Vector2f& place : {middle, Vector2f(0.5f * (middle + inside))})
        EXPECT_NEAR(mean_around(picture, place, 0) / radiance, 1, 0.05f) << roughness;
      EXPECT_NEAR(mean_around(picture, middle, 4) / radiance, 1, 0.02f) << roughness;
      EXPECT_NEAR(mean_around(picture, inside, 0) / radiance, lamp.size.x() > 0 ? 1 : 0, 0.1f) << roughness;
      EXPECT_NEAR(mean_around(picture, outside, 0) / radiance, 0, 0.02f) << roughness;
    }
    s.stage.remove(mirror);
  }
}

// The highlight of a lamp contains the same light whether or not mirrored rays are traced, which they are up
// to a roughness^2 of 0.1.
TEST_F(TracedLight, OfAHighlightDoesNotDependOnHowItIsSampled) {
  look({.eye = {0, 0, 4}, .target = {0, 0, 0}, .fov_deg = 30});
  s.stage.set_lamps(std::array{
      Lamp{.position = {0, 0.5f, 6}, .intensity = {2, 2, 2}, .size = {1.5f, 1}, .direction = {0, 0, -1}}});
  std::vector<float> light;
  for (const float roughness : {0.316f, 0.317f}) {
    const InstanceHandle mirror =
        s.add(make_box({6, 6, 0.1f}), {.color = {1, 1, 1, 1}, .metallic = 1, .roughness = roughness},
              {0, 0, -0.05f});
    light.push_back(mean_around(mean_of(s, 4), {80, 60}, 50));
    s.stage.remove(mirror);
  }
  EXPECT_NEAR(light[0] / light[1], 1, 0.01f);
}

/// Returns the sum of a picture's light over the solid angle of its pixels.
double light_in_picture(const Camera& camera, const HdrImage& picture) {
  double sum = 0;
  for (std::size_t i = 1; i < picture.rgba.size(); i += 4) sum += static_cast<double>(picture.rgba[i]);
  const double pixel = 2 * std::tan(static_cast<double>(camera.fov_deg) * std::numbers::pi / 360) /
                       static_cast<double>(picture.height_px);
  return sum * pixel * pixel;
}

// A mirror ball scatters the light of a distant source evenly: intensity = irradiance * radius^2 / 4. The
// glint of the sun is the same light whatever the size of the pixels.
TEST(SunGlint, OfAMirrorBallHasTheLightOfItsCrossSection) {
  const Camera camera{.eye = {0, 0, 60}, .target = {0, 0, 0}, .fov_deg = 2.4f};
  const double expected = std::numbers::pi * 0.25 / (60 * 60);  // of a sun of intensity 1
  for (const int height_px : {12, 60, 240}) {
    for (const bool tessellated : {true, false}) {
      for (const float roughness : {0.02f, 0.1f, 0.2f}) {
        SmallStage s(height_px, height_px);
        s.stage.set_environment(kNoLight);
        s.stage.set_sun({.direction = Vector3f(0.5f, 0.4f, 1).normalized(), .intensity = 1});
        s.stage.set_camera(camera);
        if (tessellated) {
          s.add(make_sphere(1, 96), {.color = {1, 1, 1, 1}, .metallic = 1, .roughness = roughness});
        } else {
          const PointsHandle points =
              s.stage.add_points({.style = PointStyle::sphere, .metallic = 1, .roughness = roughness});
          s.stage.set_points(
              points, std::array{Point{.position = {0, 0, 0}, .radius = 1, .color = Vector4f::Ones()}});
        }
        EXPECT_NEAR(light_in_picture(camera, mean_of(s, 16)) / expected, 1, 0.12)
            << height_px << " px, roughness " << roughness << (tessellated ? ", mesh" : ", point");
      }
    }
  }
}

// Across a thin bar all normals are within a pixel, but along it they are the same: the bar is only bright
// where its axis is nearly perpendicular to the half vector.
TEST(SunGlint, OfABarDoesNotDependOnTheSizeOfThePixels) {
  const Camera camera{.eye = {0, 0, 60}, .target = {0, 0, 0}, .fov_deg = 2.4f};
  for (const float tilt : {0.0f, 0.12f, 0.3f}) {
    std::vector<double> light;
    for (const int height_px : {16, 40, 400}) {
      SmallStage s(height_px, height_px);
      s.stage.set_environment(kNoLight);
      s.stage.set_sun({.direction = Vector3f(2 * tilt, 0.5f, 1).normalized(), .intensity = 1});
      s.stage.set_camera(camera);
      const InstanceHandle bar =
          s.add(make_cylinder(0.1f, 2), {.color = {1, 1, 1, 1}, .metallic = 1, .roughness = 0.25f});
      s.stage.set_transform(
          bar, Eigen::Affine3f(Eigen::AngleAxisf(std::numbers::pi_v<float> / 2, Vector3f::UnitZ())));
      light.push_back(light_in_picture(camera, mean_of(s, 16)));
    }
    for (const double of_few_pixels : light) EXPECT_NEAR(of_few_pixels / light.back(), 1, 0.1) << tilt;
  }
}

// A ball of glass with the index of refraction 1.5 shows distant things upside down.
TEST_F(TracedLight, ABallOfGlassTurnsThePictureUpsideDown) {
  s.add(make_sphere(1), {.color = {1, 1, 1, 1}, .roughness = 0.01f, .transmission = 1, .refraction = 1.5f});
  s.add(make_box({30, 15, 0.1f}), {.color = {0, 0, 0, 1}, .roughness = 1, .emission = {1, 0, 0}},
        {0, 7.5f, -10});
  s.add(make_box({30, 15, 0.1f}), {.color = {0, 0, 0, 1}, .roughness = 1, .emission = {0, 1, 0}},
        {0, -7.5f, -10});
  look({.eye = {0, 0, 5}, .target = {0, 0, 0}});
  const HdrImage picture = mean_of(s, 4);
  for (const float y : {0.2f, 0.5f}) {
    const Vector2f above = place_of({0, y, 0}), below = place_of({0, -y, 0});
    EXPECT_GT(pixel(picture, 80, static_cast<int>(above.y())).y(), 0.8f) << y;
    EXPECT_LT(pixel(picture, 80, static_cast<int>(above.y())).x(), 0.1f) << y;
    EXPECT_GT(pixel(picture, 80, static_cast<int>(below.y())).x(), 0.8f) << y;
  }
}

// On a coarse ball with smooth normals, brightness falls towards the terminator as on a true one, although
// the triangles there turn away from the sun. A mirror shows the same.
TEST_F(TracedLight, OfACoarseSmoothBallFallsEvenlyTowardsItsTerminator) {
  const float turn = 10 * std::numbers::pi_v<float> / 180;
  s.stage.set_sun({.direction = {std::cos(turn), 0, std::sin(turn)}, .intensity = 1, .size_deg = 0.1f});
  s.add(make_sphere(1, 12), {.color = {1, 1, 1, 1}, .roughness = 1});
  // `eye`: from which the ball, or its mirror image, is seen along the Z axis.
  const auto expect_cosines = [&](const Camera& eye, bool mirrored) {
    const HdrImage picture = mean_of(s, 16);
    for (float angle = 30; angle < 100; angle += 4) {  // from the sun
      const float a = angle * std::numbers::pi_v<float> / 180 + turn;
      Vector2f place = project(eye, {0.99f * std::cos(a), 0.1f, 0.99f * std::sin(a)}, 160, 120);
      if (mirrored) place.x() = 160 - place.x();
      EXPECT_NEAR(mean_around(picture, place, 1), std::max(std::cos(a - turn), 0.0f), 0.08f)
          << angle << (mirrored ? " mirrored" : "");
    }
  };
  look({.eye = {0, 0, 4}, .target = {0, 0, 0}, .fov_deg = 35});
  expect_cosines(camera, false);
  s.add(make_box({4, 4, 0.1f}), {.color = {1, 1, 1, 1}, .metallic = 1, .roughness = 0}, {0, 0, 8.05f});
  look({.eye = {0, 0, 4}, .target = {0, 0, 8}, .fov_deg = 12});
  expect_cosines({.eye = {0, 0, 12}, .target = {0, 0, 0}, .fov_deg = 12}, true);
}

TEST_F(TracedLight, SumsCountTheLightRemovedFromVeryBrightRays) {
  s.stage.set_environment(even_sky(0.7f));
  s.add(make_ground(20), kPlaster);
  look({.eye = {0, 1, 4}, .target = {0, 0, 0}});
  s.draw();
  EXPECT_GT(s.stage.light_sums().arriving, 0);
  EXPECT_EQ(s.stage.light_sums().removed, 0);
  s.stage.set_environment(kNoLight);
  // A particle, which only rays in random directions find.
  const PointsHandle ball = s.stage.add_points({.style = PointStyle::sphere, .lit = false});
  s.stage.set_points(ball, std::array{Point{.position = {0, 1, 0},
                                            .velocity = {0, 0, 0},
                                            .radius = 0.3f,
                                            .color = {500, 500, 500, 1},
                                            .id = 1}});
  const LightSums before = s.stage.light_sums();
  s.draw();
  const LightSums& after = s.stage.light_sums();
  // 450 of 500 parts of the light are removed.
  EXPECT_NEAR((after.removed - before.removed) / (after.arriving - before.arriving), 0.9, 0.02);
}

// Two boxes on a floor, at three sizes. A ray that starts on a surface must not intersect that surface, and
// must not miss an object that touches it.
TEST_F(TracedLight, DoesNotDependOnTheSizeOfTheScene) {
  std::vector<HdrImage> pictures;
  for (const float scale : {1.0f, 0.001f, 1000.0f}) {
    SmallStage scene(160, 120);
    scene.stage.set_environment(even_sky(0.5f));
    scene.stage.set_sun({.direction = Vector3f(1, 2, 1).normalized()});
    scene.stage.set_camera({.eye = Vector3f(2, 2, 4) * scale, .target = {0, 0, 0}});
    scene.add(make_box(Vector3f(8, 0.2f, 8) * scale), kPlaster, Vector3f(0, -0.1f, 0) * scale);
    scene.add(make_box(Vector3f(1, 1, 1) * scale), kPlaster, Vector3f(0, 0.5f, 0) * scale);
    scene.add(make_box(Vector3f(1, 1, 1) * scale), kPlaster, Vector3f(1.2f, 0.5f, -1) * scale);
    pictures.push_back(mean_of(scene, 4));
  }
  for (const std::size_t k : {1, 2}) {
    double off = 0;
    for (std::size_t i = 0; i < pictures[0].rgba.size(); ++i)
      off += std::abs(pictures[k].rgba[i] - pictures[0].rgba[i]);
    EXPECT_LT(off / static_cast<double>(pictures[0].rgba.size()), 0.003) << k;
  }
}

TEST_F(TracedLight, HasTheSameBitsForAnyNumberOfThreads) {
  s.stage.set_environment(even_sky(0.5f));
  s.stage.set_sun({});
  s.stage.set_lamps(std::array{Lamp{.position = {1, 2, 1}}});
  s.add(make_ground(20), kPlaster);
  s.add(make_sphere(0.5f), {.color = {0.9f, 0.7f, 0.3f, 1}, .metallic = 1, .roughness = 0.3f}, {0, 0.5f, 0});
  look({.eye = {0, 1, 3}, .target = {0, 0.3f, 0}});
  std::vector<HdrImage> pictures;
  for (const int threads : {1, 4}) {
    tbb::task_arena arena(threads);
    pictures.push_back(arena.execute([&] { return mean_of(s, 2); }));
  }
  EXPECT_EQ(pictures[0].rgba, pictures[1].rgba);
}

// The frames of a still scene must not differ at all, and under a slowly moving camera the light of a surface
// must not change from frame to frame.
TEST_F(TracedLight, DoesNotFlicker) {
  s.stage.set_environment(even_sky(0.5f));
  s.stage.set_sun({.direction = Vector3f(1, 1, 0.3f).normalized()});
  s.add(make_ground(20), {.color = {0.5f, 0.5f, 0.5f, 1}, .roughness = 1});
  s.add(make_box({1, 1, 1}), kPlaster, {0, 0.5f, 0});
  const Vector3f spot(-0.3f, 0, 0.9f);  // beside the box, in the open
  std::vector<float> seen;
  for (int frame = 0; frame < 12; ++frame) {
    look({.eye = {0.01f * static_cast<float>(frame), 2, 4}, .target = {0, 0.2f, 0}});
    seen.push_back(mean_around(mean_of(s, 4), place_of(spot), 0));
  }
  look({.eye = {0, 2, 4}, .target = {0, 0.2f, 0}});
  EXPECT_EQ(mean_around(mean_of(s, 4), place_of(spot), 0), seen[0]);
  float mean = 0;
  for (const float value : seen) mean += value / static_cast<float>(seen.size());
  for (const float value : seen) EXPECT_NEAR(value / mean, 1, 0.03f);
}

}  // namespace
}  // namespace offstage::render
