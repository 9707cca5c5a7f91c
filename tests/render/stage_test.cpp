#include "render/stage.h"

#include <atomic>
#include <cmath>
#include <stdexcept>

#include "render/error.h"
#include "render/tone_map.h"
#include "tests/render/gl_fixture.h"

namespace offstage::render {
namespace {

// A material that shows its colour under any light.
Material glowing(const Vector3f& radiance) {
  return {.color = {0, 0, 0, 1}, .roughness = 1, .emission = radiance};
}

Point point_at(const Vector3f& position, float radius, const Vector4f& color, uint64_t id = 0) {
  return {.position = position, .velocity = Vector3f::Zero(), .radius = radius, .color = color, .id = id};
}

double brightness(const HdrImage& image) {
  double sum = 0;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) sum += static_cast<double>(image.rgba[i]);
  return sum;
}

TEST(Stage, AnEmptyStageDrawsNothing) {
  SmallStage s;
  const HdrImage picture = s.draw();
  ASSERT_EQ(picture.rgba.size(), 96u * 64u * 4u);
  for (const float value : picture.rgba) ASSERT_EQ(value, 0);
}

// The request comes while rays are traced. The next drawing does not depend on the one that was ended.
TEST(Stage, EndsADrawingThatIsNoLongerNeeded) {
  SmallStage s;
  s.stage.set_environment({});
  s.add(make_sphere(1), Material{});
  const HdrImage whole = s.draw();
  HdrImage sum;
  std::atomic<int> asked = 0;
  EXPECT_THROW(s.stage.draw({}, sum, [&] { return ++asked > 3; }), StoppedError);
  EXPECT_GT(asked, 3);
  EXPECT_EQ(brightness(sum), 0);
  EXPECT_EQ(s.draw().rgba, whole.rgba);
}

TEST(Stage, EmptyMeshesAndPointSetsAreHarmless) {
  SmallStage s;
  s.add(Mesh{}, Material{});
  s.stage.set_points(s.stage.add_points({}), {});
  EXPECT_EQ(brightness(s.draw()), 0);
}

TEST(Stage, SkyFillsAVisibleBackgroundAndIsBrightestAtTheHorizon) {
  SmallStage s;
  s.stage.set_environment({});
  s.stage.set_sun({.direction = Vector3f(0, 0.3f, 1).normalized()});  // behind the camera
  s.stage.set_camera({.eye = {0, 2, 5}, .target = {0, 3, 0}, .fov_deg = 60});
  const HdrImage picture = s.draw();
  for (int y = 0; y < picture.height_px; ++y) EXPECT_EQ(pixel(picture, 10, y).w(), 1);
  EXPECT_GT(pixel(picture, 48, 40).x(), 1.5f * pixel(picture, 48, 2).x());
}

TEST(Stage, UnlitGreyComesBackThroughTheLinearCurve) {
  SmallStage s;
  const PointsHandle points = s.stage.add_points({.style = PointStyle::sphere, .lit = false});
  s.stage.set_points(points, std::array{point_at({0, 0, 0}, 1, {0.5f, 0.5f, 0.5f, 1})});
  const Image shown = tone_map(s.draw(), {.curve = ToneCurve::linear, .dither = false});
  const std::size_t center = 4 * (32 * 96 + 48);
  EXPECT_NEAR(shown.rgba[center], 188, 1);  // one half, encoded as sRGB
  EXPECT_EQ(shown.rgba[center + 3], 255);
}

TEST(Stage, WithoutFogNothingFadesWithDistance) {
  SmallStage s;
  s.stage.set_environment({.clouds = 0, .fog = 0});
  const InstanceHandle box = s.add(make_box({1, 1, 1}), glowing({1, 0, 0}));
  const PointsHandle sprite = s.stage.add_points({.lit = false, .softness = 0.01f}),
                     puff = s.stage.add_points({.style = PointStyle::smoke, .lit = false});
  const auto shown_at = [&](float distance, float half) {
    s.stage.set_transform(box, Eigen::Translation3f(-2 * half, 0, 5 - distance) * Eigen::Scaling(2 * half));
    s.stage.set_points(sprite, std::array{point_at({0, 0, 5 - distance}, half, {0, 1, 0, 1})});
    s.stage.set_points(puff, std::array{point_at({2 * half, 0, 5 - distance}, half, {0, 0, 1, 1})});
    const HdrImage picture = s.draw();
    return std::array{pixel(picture, 48 - 18, 32), pixel(picture, 48, 32), pixel(picture, 48 + 18, 32)};
  };
  const auto near = shown_at(5, 0.5f), far = shown_at(5000, 500);
  EXPECT_GT(near[0].x(), 0.99f);
  EXPECT_GT(near[1].y(), 0.99f);
  EXPECT_GT(near[2].z(), 0.3f);
  for (std::size_t k = 0; k < near.size(); ++k) EXPECT_LT((near[k] - far[k]).norm(), 1e-3f) << k;
}

TEST(Stage, EndlessPlaneMeetsTheSkyAtTheHorizonAtEveryScale) {
  // The camera looks along the plane: the horizon is in the middle of the picture, and a degree covers 51
  // rows.
  std::array<Vector4f, 3> first;
  for (const float height : {0.1f, 1.5f, 100.0f}) {
    SmallStage s(16, 512);
    s.stage.set_environment({});
    s.stage.set_camera({.eye = {0, height, 0}, .target = {0, height, -1}, .fov_deg = 10});
    s.add(make_ground(256'000), glowing({1, 0, 1}));
    const HdrImage picture = s.draw();
    const float px_per_rad = 256 / std::tan(0.0872665f);
    const int near_row = 256 + static_cast<int>(0.05f * px_per_rad);  // 3 degrees below the horizon
    EXPECT_GT(pixel(picture, 8, near_row).x() - pixel(picture, 8, near_row).y(), 0.97f) << height;
    EXPECT_LT((pixel(picture, 8, 258) - pixel(picture, 8, 252)).head<3>().norm(), 0.05f) << height;
    for (int y = 1; y < 512; ++y)  // neighbouring rows differ little everywhere
      ASSERT_LT((pixel(picture, 8, y) - pixel(picture, 8, y - 1)).norm(), 0.12f) << height << ' ' << y;
    const std::array rows{pixel(picture, 8, 262), pixel(picture, 8, 270), pixel(picture, 8, 300)};
    if (height == 0.1f) first = rows;
    for (std::size_t k = 0; k < rows.size(); ++k) EXPECT_LT((rows[k] - first[k]).norm(), 0.01f) << height;
  }
}

TEST(Stage, BlendedTextureOfAlphaNearOneLeavesNoHoles) {
  SmallStage s;
  s.stage.set_environment({});
  Image image{64, 1, {}};
  for (int i = 0; i < 64; ++i)
    image.rgba.insert(image.rgba.end(), {200, 100, 50, static_cast<uint8_t>(192 + i)});
  Material look{.roughness = 1};
  look.base_color_texture.image = 0;
  const MaterialHandle material = s.stage.add_material(look, std::array{image});
  Mesh quad = make_box({4, 3, 0.1f});
  for (std::size_t i = 0; i < quad.uvs.size(); ++i)
    quad.uvs[i] = {0.25f * quad.positions[i].x() + 0.5f, 0.5f};
  const InstanceHandle pane = s.stage.add_instance(s.stage.add_mesh(quad), material);
  const HdrImage opaque = s.draw();
  for (std::size_t i = 3; i < opaque.rgba.size(); i += 4) ASSERT_FLOAT_EQ(opaque.rgba[i], 1);
  EXPECT_FALSE(opaque.transparent);

  s.stage.set_environment({.visible = false});
  EXPECT_TRUE(s.draw().transparent);
  s.stage.set_visible(pane, false);
  EXPECT_TRUE(tone_map(s.draw(), {}).transparent);
}

TEST(Stage, WhiteSurfaceFacingTheSunHasTheSunsRadianceInItsDiffusePart) {
  SmallStage s;
  s.stage.set_sun({.direction = Vector3f::UnitZ(), .color = {1, 1, 1}, .intensity = 2, .shadows = false});
  s.stage.set_environment({.intensity = 0, .visible = false});
  s.add(make_box({3, 3, 1}), {.color = {1, 1, 1, 1}, .roughness = 1});
  // The Fresnel term removes 4 % of the diffuse part, and the rough highlight adds about 1 %.
  EXPECT_NEAR(center_pixel(s.draw()).x(), 2, 0.1);
}

TEST(Stage, AmbientLightOfAnEvenSkyIsItsRadiance) {
  SmallStage s;
  const Vector3f even(0.5f, 0.5f, 0.5f);
  s.stage.set_sun({.intensity = 0});
  s.stage.set_environment({.zenith = even, .horizon = even, .ground = even, .visible = false});
  s.add(make_box({3, 3, 1}), {.color = {1, 1, 1, 1}, .roughness = 1});
  EXPECT_NEAR(center_pixel(s.draw()).x(), 0.5, 0.015);
}

TEST(Stage, NearerBodiesHideFartherOnesInAnyOrder) {
  for (const bool near_first : {true, false}) {
    SmallStage s;
    const Mesh box = make_box({1, 1, 0.2f});
    const auto add_near = [&] { s.add(box, glowing({1, 0, 0}), {0, 0, 1}); };
    if (near_first) add_near();
    s.add(box, glowing({0, 1, 0}), {0, 0, -1});
    if (!near_first) add_near();
    const Vector4f seen = center_pixel(s.draw());
    EXPECT_GT(seen.x(), 0.9f);
    EXPECT_LT(seen.y(), 0.3f);
  }
}

// Draws of many triangles are split. Each object covers the picture with more of them than one part has.
TEST(Stage, DrawsAllPartsOfLargeObjects) {
  constexpr int kColumns = 130, kRows = 90;
  static constexpr float kSide = 0.06f;
  const auto place = [](int column, int row) {
    return Vector3f(kSide * (static_cast<float>(column) - 0.5f * kColumns),
                    kSide * (static_cast<float>(row) - 0.5f * kRows), 0);
  };
  const Material material = glowing({1, 1, 1});
  const auto add_quad = [](Mesh& mesh, const Vector3f& corner) {
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    for (const Vector3f& offset :
         {Vector3f(0, 0, 0), Vector3f(1, 0, 0), Vector3f(1, 1, 0), Vector3f(0, 1, 0)}) {
      mesh.positions.push_back(corner + kSide * offset);
      mesh.normals.push_back(Vector3f::UnitZ());
      mesh.uvs.push_back(offset.head<2>());
    }
    for (const uint32_t i : {0u, 1u, 2u, 0u, 2u, 3u}) mesh.indices.push_back(first + i);
  };
  SmallStage mesh, instances, balls;
  Mesh grid, quad;
  std::vector<Point> points;
  add_quad(quad, Vector3f::Zero());
  const MeshHandle quads = instances.stage.add_mesh(quad);
  const MaterialHandle bright = instances.stage.add_material(material);
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      add_quad(grid, place(column, row));
      points.push_back(point_at(place(column, row), kSide, Vector4f::Ones(), points.size()));
      instances.stage.set_transform(instances.stage.add_instance(quads, bright),
                                    Eigen::Affine3f(Eigen::Translation3f(place(column, row))));
    }
  }
  mesh.add(grid, material);
  balls.stage.set_points(balls.stage.add_points({.style = PointStyle::sphere}), points);
  for (SmallStage* stage : {&mesh, &instances, &balls}) {
    const HdrImage picture = stage->draw();
    int covered = 0;
    for (std::size_t i = 3; i < picture.rgba.size(); i += 4) covered += picture.rgba[i] == 1;
    EXPECT_EQ(covered, picture.width_px * picture.height_px);
  }
}

// The scene has more glowing bodies than the tracer samples as lamps. Each number of bodies gives another
// layout of the memory.
TEST(Stage, DrawsAnyNumberOfGlowingBodies) {
  SmallStage s;
  const MeshHandle ball = s.stage.add_mesh(make_sphere(0.1f, 12));
  const MaterialHandle bright = s.stage.add_material(glowing({1, 1, 1}));
  for (int i = 0; i < 120; ++i) {
    const float turn = 0.1f * static_cast<float>(i);
    s.stage.set_transform(
        s.stage.add_instance(ball, bright),
        Eigen::Affine3f(Eigen::Translation3f(std::cos(turn), std::sin(turn), -0.01f * turn)));
    if (i < 60) continue;
    const HdrImage picture = s.draw();
    const Vector2f place = project({.eye = {0, 0, 5}, .target = {0, 0, 0}}, {1, 0, 0}, 96, 64);
    EXPECT_GT(pixel(picture, static_cast<int>(place.x()), static_cast<int>(place.y())).x(), 0.5f) << i;
  }
}

TEST(Stage, DepthIsPreciseFarAway) {
  SmallStage s;
  s.stage.set_camera(
      {.eye = {0, 0, 200}, .target = {0, 0, 0}, .fov_deg = 0.5f, .near_m = 0.05f, .far_m = 5000});
  s.add(make_box({3, 3, 0.01f}), glowing({10, 0, 0}), {0, 0, 0.01f});
  s.add(make_box({3, 3, 0.01f}), glowing({0, 10, 0}));
  const Vector4f seen = center_pixel(s.draw());
  EXPECT_GT(seen.x(), 3 * seen.y());
}

TEST(Stage, RayCastSphereEqualsATessellatedOne) {
  // Off the axis, where the silhouette in perspective is an ellipse.
  const Vector3f center(1.2f, 0.6f, 1);
  SmallStage ball(192, 128), mesh(192, 128);
  const Vector4f color(0.7f, 0.3f, 0.2f, 1);
  const PointsHandle points = ball.stage.add_points({.style = PointStyle::sphere, .roughness = 0.4f});
  ball.stage.set_points(points, std::array{point_at(center, 0.8f, color)});
  mesh.add(make_sphere(0.8f, 192), {.color = color, .roughness = 0.4f}, center);
  const HdrImage a = ball.draw(), b = mesh.draw();
  int silhouette_differs = 0, shading_differs = 0, covered = 0;
  for (int y = 0; y < a.height_px; ++y) {
    for (int x = 0; x < a.width_px; ++x) {
      const Vector4f p = pixel(a, x, y), q = pixel(b, x, y);
      covered += q.w() > 0;
      if (p.w() != q.w()) {
        ++silhouette_differs;
      } else if ((p - q).cwiseAbs().maxCoeff() > 0.05f * (0.2f + q.maxCoeff())) {
        ++shading_differs;
      }
    }
  }
  EXPECT_GT(covered, 1000);
  EXPECT_LE(silhouette_differs, 12);
  // near the terminator, where facets of the mesh shadow each other
  EXPECT_LE(shading_differs, covered / 50);
}

TEST(Stage, SphereImpostorsCutEachOtherWhereTheirSurfacesMeet) {
  SmallStage s;
  const PointsHandle points = s.stage.add_points({.style = PointStyle::sphere, .lit = false});
  s.stage.set_points(points, std::array{point_at({-0.3f, 0, 0}, 0.6f, {1, 0, 0, 1}, 1),
                                        point_at({0.3f, 0, 0}, 0.6f, {0, 1, 0, 1}, 2)});
  const HdrImage picture = s.draw();
  EXPECT_GT(pixel(picture, 45, 32).x(), 0.9f);
  EXPECT_GT(pixel(picture, 51, 32).y(), 0.9f);
}

// Looks down on a white floor with a ball of radius 0.5 at a height of 2.
struct ShadowScene {
  Camera camera{.eye = {0, 12, 0.01f}, .target = {0, 0, 0}};
  SmallStage s{160, 120};
  explicit ShadowScene(const Vector3f& towards_sun, bool point_caster = false) {
    s.stage.set_camera(camera);
    s.stage.set_sun({.direction = towards_sun.normalized()});
    s.add(make_ground(50), {.color = {0.8f, 0.8f, 0.8f, 1}, .roughness = 1});
    const Vector3f center(0, 2, 0);
    if (point_caster) {
      s.stage.set_points(s.stage.add_points({.softness = 0.1f}),
                         std::array{point_at(center, 0.5f, {1, 1, 1, 1})});
    } else {
      s.add(make_sphere(0.5f), {}, center);
    }
  }
  float floor_at(float x, float z) {
    const Vector2f place = project(camera, {x, 0, z}, 160, 120);
    return pixel(s.draw(), static_cast<int>(place.x()), static_cast<int>(place.y())).y();
  }
};

TEST(Stage, ShadowFallsWhereGeometryPredicts) {
  for (const bool point_caster : {false, true}) {
    // The sun is at 45 degrees above +X: the centre of the shadow is at x = -2, its half-axes are 0.5 across
    // and 0.71 along.
    ShadowScene scene({1, 1, 0}, point_caster);
    const float light = scene.floor_at(3, 2);
    EXPECT_LT(scene.floor_at(-2, 0), 0.5f * light);
    EXPECT_LT(scene.floor_at(-2.5f, 0), 0.5f * light);
    EXPECT_LT(scene.floor_at(-2, 0.35f), 0.5f * light);
    EXPECT_GT(scene.floor_at(-3, 0), 0.9f * light);
    EXPECT_GT(scene.floor_at(-2, 0.8f), 0.9f * light);
  }
}

TEST(Stage, ShadowMovesWithTheSun) {
  ShadowScene scene({0, 1, -1});
  const float light = scene.floor_at(3, 2);
  EXPECT_LT(scene.floor_at(0, 2), 0.5f * light);
  EXPECT_GT(scene.floor_at(-2, 0), 0.9f * light);
}

TEST(Stage, ShadowsSoftenWithTheSizeOfTheSun) {
  // A caster 2 m up under a sun disc of 20 degrees has a penumbra 0.7 m wide; 0.3 m inside it, the light is
  // partly back.
  ShadowScene scene({0.01f, 1, 0});
  scene.s.stage.set_camera(scene.camera = {.eye = {3, 12, 0.01f}, .target = {3, 0, 0}});
  scene.s.stage.set_sun({.direction = Vector3f(1, 1, 0).normalized(), .size_deg = 20});
  HdrImage sum;
  constexpr int kSamples = 16;
  scene.s.stage.set_camera(scene.camera = {.eye = {-2, 12, 0.01f}, .target = {-2, 0, 0}});
  for (int i = 0; i < kSamples; ++i) scene.s.stage.draw(sample_offsets(i, kSamples), sum);
  const auto at = [&](float z) {
    const Vector2f place = project(scene.camera, {-2, 0, z}, 160, 120);
    return pixel(sum, static_cast<int>(place.x()), static_cast<int>(place.y())).y();
  };
  const float dark = at(0), light = at(2);
  EXPECT_GT(at(0.5f), dark + 0.2f * (light - dark));
  EXPECT_LT(at(0.5f), dark + 0.8f * (light - dark));
}

TEST(Stage, FlatGroundDoesNotShadowItself) {
  ShadowScene scene({1, 0.35f, 0.2f});
  float low = 1e9f, high = 0;
  for (float z = -3; z <= 3; z += 0.1f) {
    const float value = scene.floor_at(3, z);
    low = std::min(low, value);
    high = std::max(high, value);
  }
  EXPECT_GT(low, 0.97f * high);
}

TEST(Stage, TransparentBackgroundHasAlphaZeroAndObjectsHaveAlphaOne) {
  SmallStage s;
  s.add(make_box({1, 1, 1}), Material{});
  const HdrImage picture = s.draw();
  EXPECT_EQ(center_pixel(picture).w(), 1);
  EXPECT_EQ(pixel(picture, 2, 2), Vector4f(0, 0, 0, 0));
}

TEST(Stage, SubFramesAddUp) {
  SmallStage s;
  s.stage.set_environment({});
  s.add(make_box({1, 1, 1}), Material{});
  const HdrImage one = s.draw();
  HdrImage sum;
  for (int i = 0; i < 4; ++i) s.stage.draw({}, sum);
  for (std::size_t i = 0; i < one.rgba.size(); ++i) ASSERT_FLOAT_EQ(sum.rgba[i], 4 * one.rgba[i]);
}

TEST(Stage, BlendedPointsDoNotDependOnTheirOrderInTheSet) {
  SmallStage s;
  const PointsHandle points = s.stage.add_points({.lit = false, .casts_shadow = false});
  std::vector<Point> values;
  for (uint64_t i = 0; i < 24; ++i) {
    const float depth = static_cast<float>(i / 3) * 0.1f;  // three at each depth, so that depths are equal
    values.push_back(point_at({0.05f * static_cast<float>(i % 5), 0, depth}, 0.5f,
                              {static_cast<float>(i % 2), 0.5f, static_cast<float>(i % 3), 0.5f}, i));
  }
  s.stage.set_points(points, values);
  const HdrImage forwards = s.draw();
  std::reverse(values.begin(), values.end());
  s.stage.set_points(points, values);
  EXPECT_GT(center_pixel(forwards).w(), 0.9f);
  EXPECT_EQ(forwards.rgba, s.draw().rgba);
}

TEST(Stage, NearerBlendedSurfaceCoversTheFartherOne) {
  for (const float first_z : {-1.0f, 1.0f}) {
    SmallStage s;
    const auto add = [&](float z) {
      Material glass = glowing(z > 0 ? Vector3f(1, 0, 0) : Vector3f(0, 1, 0));
      glass.color.w() = 0.5f;
      s.add(make_box({1, 1, 0.01f}), glass, {0, 0, z});
    };
    add(first_z);
    add(-first_z);
    const Vector4f seen = center_pixel(s.draw());
    EXPECT_NEAR(seen.w(), 0.75f, 1e-4f);
    EXPECT_GT(seen.x(), 1.5f * seen.y());
  }
}

TEST(Stage, NearerPartOfABlendedMeshCoversTheFartherOne) {
  const auto add_square = [](Mesh& mesh, float z, const Vector4f& color) {
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    for (const Vector2f& corner : {Vector2f(-1, -1), Vector2f(1, -1), Vector2f(1, 1), Vector2f(-1, 1)}) {
      mesh.positions.emplace_back(corner.x(), corner.y(), z);
      mesh.normals.emplace_back(0, 0, 1);
      mesh.uvs.push_back(corner);
      mesh.colors.push_back(color);
    }
    for (const uint32_t corner : {0u, 1u, 2u, 0u, 2u, 3u}) mesh.indices.push_back(first + corner);
  };
  const Material material{.color = {1, 1, 1, 1}, .unlit = true, .vertex_colors = true, .vertex_alpha = true};
  std::array<float, 3> layers = {-0.5f, 0, 0.5f};
  do {
    Mesh mesh;
    for (const float z : layers)
      add_square(mesh, z,
                 z < 0   ? Vector4f(1, 0, 0, 0.5f)
                 : z > 0 ? Vector4f(0, 0, 1, 0.5f)
                         : Vector4f(0, 1, 0, 0.5f));
    SmallStage s;
    s.add(mesh, material);
    EXPECT_LT((center_pixel(s.draw()) - Vector4f(0.125f, 0.25f, 0.5f, 0.875f)).norm(), 0.01f)
        << layers[0] << " " << layers[1];
  } while (std::ranges::next_permutation(layers).found);
}

TEST(Stage, AddedLightCoversNothing) {
  SmallStage s;
  s.add(make_box({3, 3, 0.1f}), glowing({0.3f, 0.3f, 0.3f}), {0, 0, -2});
  const float before = center_pixel(s.draw()).x();
  const PointsHandle points = s.stage.add_points({.additive = true, .lit = false, .casts_shadow = false});
  s.stage.set_points(points, std::array{point_at({0, 0, 0}, 0.5f, {2, 0, 0, 0.5f})});
  EXPECT_NEAR(center_pixel(s.draw()).x(), before + 1, 0.01f);
}

TEST(Stage, SpritesFadeWhereTheyMeetASurface) {
  SmallStage s;
  s.add(make_box({3, 3, 1}), glowing({0, 0, 0}), {0, 0, -0.5f});  // its front face is at z = 0
  const PointsHandle points = s.stage.add_points({.lit = false, .casts_shadow = false});
  const auto red_at = [&](float z) {
    s.stage.set_points(points, std::array{point_at({0, 0, z}, 0.4f, {5, 0, 0, 1})});
    return center_pixel(s.draw()).x();
  };
  EXPECT_NEAR(red_at(0.6f), 5, 0.2);
  EXPECT_NEAR(red_at(0.2f), 2.5, 0.4);
  EXPECT_LT(red_at(0.01f), 0.3f);
}

TEST(Stage, StreakIsAsLongAsItsMotion) {
  const Camera camera{.eye = {0, 0, 5}};
  for (const float speed : {20.0f, 40.0f}) {
    SmallStage s(320, 96);
    s.stage.set_camera(camera);
    const PointsHandle points =
        s.stage.add_points({.style = PointStyle::streak, .lit = false, .stretch_s = 0.05f});
    Point streak = point_at({0, 0, 0}, 0.04f, {1, 1, 1, 1});
    streak.velocity = {speed, 0, 0};
    s.stage.set_points(points, std::array{streak});
    const HdrImage picture = s.draw();
    double length_px = 0;
    for (int x = 0; x < picture.width_px; ++x) length_px += static_cast<double>(pixel(picture, x, 48).w());
    const double expected = 2 * (project(camera, {0.5f * speed * 0.05f, 0, 0}, 320, 96).x() - 160.0);
    EXPECT_NEAR(length_px, expected, 2);
  }
}

TEST(Stage, ThinStreaksKeepTheirLightAndGetFainter) {
  const auto light_of = [](float radius) {
    SmallStage s(160, 96);
    const PointsHandle points =
        s.stage.add_points({.style = PointStyle::streak, .lit = false, .stretch_s = 0.05f});
    Point streak = point_at({0, 0.003f, 0}, radius, {1, 1, 1, 1});
    streak.velocity = {20, 3, 0};
    s.stage.set_points(points, std::array{streak});
    return brightness(s.draw());
  };
  EXPECT_NEAR(light_of(0.002f) / light_of(0.001f), 2, 0.1);
}

TEST(Stage, LensBlursOnlyObjectsOutOfFocus) {
  const auto contrast = [](float z) {
    SmallStage s;
    s.stage.set_camera({.eye = {0, 0, 5}, .aperture = 0.6f, .focus = 5});
    s.add(make_box({1, 40, 0.01f}), glowing({1, 1, 1}),
          {0.5f, 0, z});  // the left edge of the box is in the middle of the picture
    HdrImage sum;
    constexpr int kSamples = 16;
    for (int i = 0; i < kSamples; ++i) s.stage.draw({.lens = sample_offsets(i, kSamples).lens}, sum);
    return (pixel(sum, 49, 32).x() - pixel(sum, 46, 32).x()) / kSamples;
  };
  EXPECT_GT(contrast(0), 0.95f);
  EXPECT_LT(contrast(2.5f), 0.5f);
}

TEST(Stage, PixelOffsetMovesThePictureByThatMuch) {
  SmallStage s;
  s.add(make_box({1, 40, 0.01f}), glowing({1, 1, 1}), {0.5f, 0, 0});
  double covered = 0;
  constexpr int kSamples = 32;
  HdrImage sum;
  for (int i = 0; i < kSamples; ++i) s.stage.draw({.pixel = sample_offsets(i, kSamples).pixel}, sum);
  for (int x = 0; x < sum.width_px; ++x) covered += static_cast<double>(pixel(sum, x, 32).w()) / kSamples;
  const Camera camera{.eye = {0, 0, 5}};
  EXPECT_NEAR(covered, project(camera, {1, 0, 0.005f}, 96, 64).x() - 48, 0.05);
}

TEST(Stage, TransformMovesMirrorsAndHides) {
  SmallStage s;
  const InstanceHandle box = s.add(make_box({0.4f, 0.4f, 0.4f}), glowing({1, 1, 1}));
  EXPECT_EQ(center_pixel(s.draw()).w(), 1);
  Eigen::Affine3f mirrored(Eigen::Translation3f(1, 0, 0));
  mirrored.scale(Vector3f(-1, 1, 1));
  s.stage.set_transform(box, mirrored);
  const HdrImage moved = s.draw();
  EXPECT_EQ(center_pixel(moved).w(), 0);
  EXPECT_GT(brightness(moved), 0);
  s.stage.set_visible(box, false);
  EXPECT_EQ(brightness(s.draw()), 0);
}

TEST(Stage, TextureAlphaCutsOut) {
  SmallStage s;
  // The left half of the texture is opaque red, the right half transparent; the picture is checked in the
  // middle of each half.
  Image texture{2, 1, {255, 0, 0, 255, 255, 0, 0, 0}};
  const MaterialHandle material =
      s.stage.add_material({.color = {1, 1, 1, 1}, .emission = {0, 0, 0}, .base_color_texture = {.image = 0}},
                           std::span<const Image>(&texture, 1));
  s.stage.add_instance(s.stage.add_mesh(make_box({2, 2, 0.1f})), material);
  const HdrImage picture = s.draw();
  EXPECT_NEAR(pixel(picture, 39, 32).w(), 1, 0.03);
  EXPECT_NEAR(pixel(picture, 56, 32).w(), 0, 0.03);
}

TEST(Stage, PatternsFadeToTheirMeanInTheDistance) {
  for (const Pattern pattern : {Pattern::checker, Pattern::grid, Pattern::noise, Pattern::brick,
                                Pattern::wood, Pattern::lawn, Pattern::paving}) {
    SmallStage s;
    s.stage.set_sun({.shadows = false});
    s.stage.set_camera({.eye = {0, 0, 60}, .target = {0, 0, 0}, .fov_deg = 10});
    s.add(make_box({40, 40, 1}), {.color = {0.9f, 0.9f, 0.9f, 1},
                                  .pattern = pattern,
                                  .pattern_color = {0.1f, 0.1f, 0.1f},
                                  // a cell of the pattern is a tenth of a pixel wide
                                  .pattern_scale = 0.02f});
    const HdrImage picture = s.draw();
    float low = 1e9f, high = 0;
    for (int x = 20; x < 70; ++x) {
      low = std::min(low, pixel(picture, x, 30).x());
      high = std::max(high, pixel(picture, x, 30).x());
    }
    EXPECT_LT(high, 1.05f * low) << "pattern " << static_cast<int>(pattern);
  }
}

TEST(Stage, StaleHandlesAreRefused) {
  SmallStage s;
  const InstanceHandle instance = s.add(make_box({1, 1, 1}), Material{});
  s.stage.remove(instance);
  EXPECT_THROW(s.stage.remove(instance), std::logic_error);
  const InstanceHandle reused = s.add(make_box({1, 1, 1}), Material{});
  EXPECT_EQ(reused.index, instance.index);
  EXPECT_THROW(s.stage.set_visible(instance, true), std::logic_error);
  EXPECT_THROW(s.stage.set_points(PointsHandle{}, {}), std::logic_error);
}

TEST(SampleOffsets, AreCentredWellSpreadAndZeroForOne) {
  EXPECT_EQ(sample_offsets(0, 1).pixel, Vector2f(0, 0));
  EXPECT_EQ(sample_offsets(0, 1).light, Vector2f(0, 0));
  for (const int n : {4, 16, 5}) {
    Vector2f mean(0, 0);
    std::vector<int> columns(static_cast<std::size_t>(n), 0);
    for (int i = 0; i < n; ++i) {
      const SampleOffsets offsets = sample_offsets(i, n);
      for (const Vector2f& p : {offsets.pixel, offsets.lens, offsets.light})
        EXPECT_LE(p.cwiseAbs().maxCoeff(), 0.5f);
      mean += offsets.pixel / static_cast<float>(n);
      ++columns[static_cast<std::size_t>((offsets.pixel.x() + 0.5f) * static_cast<float>(n))];
    }
    EXPECT_LT(mean.norm(), 0.12f);
    for (const int count : columns) EXPECT_EQ(count, 1);  // one in each column of the pixel
  }
}

}  // namespace
}  // namespace offstage::render
