// The drawn surface of cloths, compared with flat sheets and balls, and its shading.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include <gtest/gtest.h>

#include "render/cloth_surface.h"
#include "render/loop_subdivision.h"
#include "tests/render/gl_fixture.h"

namespace offstage::render {
namespace {

/// A square sheet of n by n cells with edges of 2 m, in the plane z = 0, its front towards +Z.
struct Sheet {
  Sheet() = default;  ///< without triangles
  explicit Sheet(int n) {
    const auto at = [n](int i, int j) { return static_cast<uint32_t>(j * (n + 1) + i); };
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i) {
        const Vector2f uv(static_cast<float>(2 * i) / static_cast<float>(n),
                          static_cast<float>(2 * j) / static_cast<float>(n));
        uvs.push_back(uv);
        points.emplace_back(uv.x() - 1, uv.y() - 1, 0.0f);
      }
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        for (const uint32_t v :
             {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1)})
          triangles.push_back(v);
  }
  std::vector<uint32_t> triangles;
  std::vector<Vector2f> uvs;
  std::vector<Vector3f> points;
};

/// A stage with a sheet of one material, the sun and a camera on the Z axis.
struct ClothStage : SmallStage {
  ClothStage(const Material& material, const Vector3f& sun, const Vector3f& eye = {0, 0, 5}) {
    stage.set_camera({.eye = eye, .target = {0, 0, 0}});
    stage.set_environment({.intensity = 0, .visible = false});
    stage.set_sun({.direction = sun.normalized(), .color = {1, 1, 1}, .intensity = 2});
    const Sheet sheet(12);
    cloth = stage.add_cloth({.triangles = sheet.triangles, .uvs = sheet.uvs, .thickness = 0.01f},
                            stage.add_material(material));
    stage.set_cloth(cloth, sheet.points);
  }
  ClothHandle cloth;
};

Material plain(float translucency = 0) {
  Material m{.color = {0.5f, 0.5f, 0.5f, 1}, .roughness = 1};
  m.fabric = {.weave = Weave::none, .sheen = 0, .translucency = translucency};
  return m;
}

TEST(LoopSubdivision, FlatSheetsStayFlatAndKeepTheirOutline) {
  const Sheet sheet(5);
  const LoopSubdivision finer(sheet.triangles, sheet.uvs);
  std::vector<Vector3f> points;
  finer.refine(std::span<const Vector3f>(sheet.points), points);
  EXPECT_EQ(finer.triangles().size(), 4 * sheet.triangles.size());
  EXPECT_EQ(points.size(), 121u);  // 11 x 11
  Eigen::AlignedBox3f box;
  for (const Vector3f& p : points) {
    EXPECT_EQ(p.z(), 0);
    box.extend(p);
  }
  EXPECT_EQ(box.min(), Vector3f(-1, -1, 0)) << "corners stay";
  EXPECT_EQ(box.max(), Vector3f(1, 1, 0));
  EXPECT_EQ(boundary_edges(finer.triangles()).size(), 40u);
}

TEST(LoopSubdivision, RoundsACreaseAndStaysWithinItsHull) {
  Sheet sheet(8);
  for (Vector3f& p : sheet.points) p.z() = -std::abs(p.x());  // a roof
  const LoopSubdivision finer(sheet.triangles, sheet.uvs);
  std::vector<Vector3f> points;
  finer.refine(std::span<const Vector3f>(sheet.points), points);
  float top = -1;
  for (const Vector3f& p : points) top = std::max(top, p.z());
  EXPECT_LE(top, 0);
  EXPECT_LT(points[4 * 9 + 4].z(), -0.05f) << "the ridge is rounded off";
}

TEST(ClothSurface, NormalsOfABallAreItsRadii) {
  const Mesh ball = make_sphere(1, 32);
  std::vector<Vector2f> uvs(ball.positions.size(), Vector2f(0, 0));
  ClothSurface surface;
  surface.set_mesh(ball.indices, uvs);
  surface.set_positions(ball.positions, 0);
  float worst = 1;
  for (const ClothVertex& v : surface.vertices())
    if (v.lift == 0 && std::abs(v.position.normalized().y()) < 0.8f && std::abs(v.position.z()) > 0.3f)
      worst = std::min(worst, v.normal.dot(v.position.normalized()));
  EXPECT_GT(worst, std::cos(0.06f)) << "within half of a coarse facet's angle";
}

TEST(ClothSurface, RefusesInvalidMeshesAndHidesNonFiniteOnes) {
  ClothSurface surface;
  const std::vector<Vector2f> uvs(3, Vector2f(0, 0));
  EXPECT_THROW(surface.set_mesh(std::array<uint32_t, 3>{0, 1, 3}, uvs), std::invalid_argument);
  surface.set_mesh(std::array<uint32_t, 3>{0, 1, 2}, uvs);
  EXPECT_THROW(surface.set_positions(std::array{Vector3f(0, 0, 0)}, 0), std::invalid_argument);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  surface.set_positions(std::array{Vector3f(0, 0, 0), Vector3f(1, 0, 0), Vector3f(0, nan, 0)}, 0);
  EXPECT_TRUE(surface.vertices().empty());
}

TEST(StageCloth, SheetFacingTheSunHasItsAlbedoFromBothSides) {
  for (const float side : {1.0f, -1.0f}) {
    ClothStage s(plain(), {0, 0, side}, {0, 0, 5 * side});
    // The same as for the white box in StageTest: the Fresnel term removes 4 %, and the rough highlight adds
    // some of it.
    EXPECT_NEAR(center_pixel(s.draw()).x(), 1, 0.06);
  }
}

TEST(StageCloth, BackHasAColourOfItsOwn) {
  Material m = plain();
  m.fabric.back_color = Vector3f(0, 0.5f, 0);
  ClothStage front(m, {0, 0, 1}), back(m, {0, 0, -1}, {0, 0, -5});
  EXPECT_GT(center_pixel(front.draw()).x(), 0.9f);
  EXPECT_LT(center_pixel(back.draw()).x(), 0.2f);
  EXPECT_GT(center_pixel(back.draw()).y(), 0.9f);
}

TEST(StageCloth, LightShinesThroughAThinSheetAndOnlyThroughThat) {
  const auto seen = [](float translucency) {
    ClothStage s(plain(translucency), {0, 0, -1});  // the sun is behind the cloth
    return center_pixel(s.draw()).x();
  };
  EXPECT_LT(seen(0), 0.02f);
  // Half of the light; the wrapped lighting removes a tenth or more.
  EXPECT_NEAR(seen(0.5f), 0.5f * 0.9f, 0.1f);
}

TEST(StageCloth, SheetInGrazingLightDoesNotShadowItself) {
  // Even light on a flat sheet: every pixel well inside has the same brightness.
  ClothStage s(plain(), {1, 0, 0.12f});
  const HdrImage picture = s.draw();
  const float middle = center_pixel(picture).x();
  EXPECT_GT(middle, 0.05f);
  for (int y = 24; y < 40; ++y)
    for (int x = 36; x < 60; ++x)
      EXPECT_NEAR(pixel(picture, x, y).x(), middle, 0.25f * middle) << x << " " << y;
}

TEST(StageCloth, ThrowsItsShadowOnObjectsBehind) {
  ClothStage s(plain(), {0, 0.6f, 1}, {0, -3, 4});
  s.add(make_box({8, 8, 0.1f}), {.color = {1, 1, 1, 1}, .roughness = 1}, {0, 0, -1});
  const auto below = [&] { return pixel(s.draw(), 48, 58).x(); };
  const float shadowed = below();
  s.stage.remove(s.cloth);
  EXPECT_LT(shadowed, 0.3f * below());
}

/// Returns the mean red of a few pixels in the middle of a frame of `count` sub-frames, or `below_px` pixels
/// below the middle.
float mean_red(ClothStage& s, int count, int below_px = 0) {
  HdrImage sum;
  for (int i = 0; i < count; ++i) s.stage.draw(sample_offsets(i, count), sum);
  float result = 0;
  for (int y = 28; y < 36; ++y)
    for (int x = 44; x < 52; ++x) result += pixel(sum, x, y + below_px).x() / static_cast<float>(64 * count);
  return result;
}

/// Returns the material of black cloth with this alpha.
Material sheer(float alpha) {
  Material m = plain();
  m.color = {0, 0, 0, alpha};
  return m;
}

TEST(StageCloth, HidesTheBackgroundByItsOpacity) {
  for (const int count : {1, 4, 16})
    for (const float alpha : {0.25f, 0.5f, 0.9f}) {
      ClothStage s(sheer(alpha), {0, 0, -1});
      s.add(make_box({8, 8, 0.1f}), {.color = {0, 0, 0, 1}, .roughness = 1, .emission = {1, 1, 1}},
            {0, 0, -1});
      EXPECT_NEAR(mean_red(s, count), 1 - alpha, 0.03f) << count << " sub-frames";
    }
}

TEST(StageCloth, TransmissionLetsThroughAsAlphaDoes) {
  Material m = sheer(1);
  m.transmission = 0.7f;
  ClothStage s(m, {0, 0, -1});
  s.add(make_box({8, 8, 0.1f}), {.color = {0, 0, 0, 1}, .roughness = 1, .emission = {1, 1, 1}}, {0, 0, -1});
  EXPECT_NEAR(mean_red(s, 4), 0.7f, 0.03f);
}

TEST(StageCloth, TwoLayersHideMoreThanOneInAnyOrder) {
  for (const float second : {-0.5f, 0.5f}) {
    ClothStage s(sheer(0.5f), {0, 0, -1});
    s.add(make_box({8, 8, 0.1f}), {.color = {0, 0, 0, 1}, .roughness = 1, .emission = {1, 1, 1}}, {0, 0, -1});
    Sheet sheet(12);
    std::ranges::reverse(sheet.triangles);  // the back of the sheet faces the camera, as in a fold
    for (Vector3f& p : sheet.points) p.z() = second;
    const ClothHandle other = s.stage.add_cloth({.triangles = sheet.triangles, .uvs = sheet.uvs},
                                                s.stage.add_material(sheer(0.25f)));
    s.stage.set_cloth(other, sheet.points);
    EXPECT_NEAR(mean_red(s, 4), 0.5f * 0.75f, 0.02f);
  }
}

// The sun comes from the side, and a box hides it from the middle of the nearest layers only.
TEST(StageCloth, EachLayerOfAClothIsSeenInItsOwnLight) {
  Material half = plain();
  half.color = {0.8f, 0.8f, 0.8f, 0.5f};
  const auto brightness = [&](std::vector<float> layers, bool one_cloth) {
    ClothStage s(half, {1, 0, 1});
    s.stage.remove(s.cloth);
    s.add(make_box({0.8f, 0.8f, 0.8f}), {.color = {0, 0, 0, 1}, .roughness = 1}, {1.5f, 0, 2});
    const MaterialHandle material = s.stage.add_material(half);
    const auto add = [&](const Sheet& sheet) {
      s.stage.set_cloth(s.stage.add_cloth({.triangles = sheet.triangles, .uvs = sheet.uvs}, material),
                        sheet.points);
    };
    Sheet all;
    for (const float z : layers) {
      Sheet sheet(6);
      for (Vector3f& p : sheet.points) p.z() = z;
      if (!one_cloth) add(sheet);
      const auto first = static_cast<uint32_t>(all.points.size());
      for (const uint32_t v : sheet.triangles) all.triangles.push_back(first + v);
      all.points.insert(all.points.end(), sheet.points.begin(), sheet.points.end());
      all.uvs.insert(all.uvs.end(), sheet.uvs.begin(), sheet.uvs.end());
    }
    if (one_cloth) add(all);
    return mean_red(s, 4);
  };
  for (const std::vector<float>& layers : {std::vector<float>{0.5f, -1}, {-1, 0.5f}, {-1, 0.5f, -0.5f}}) {
    const float cloths = brightness(layers, false);
    EXPECT_GT(cloths, 0.01f);
    EXPECT_NEAR(brightness(layers, true), cloths, 0.03f * cloths) << layers.size();
  }
}

TEST(StageCloth, ShadowIsAsLightAsTheClothIsOpen) {
  const auto floor = [](std::optional<float> alpha) {
    ClothStage s(sheer(alpha.value_or(1)), {0, 0.6f, 1}, {0, -3, 4});
    s.add(make_box({8, 8, 0.1f}), {.color = {1, 1, 1, 1}, .roughness = 1}, {0, 0, -1});
    if (!alpha) s.stage.remove(s.cloth);
    return mean_red(s, 4, 22);
  };
  const float lit = floor(std::nullopt), dark = floor(1.0f);
  EXPECT_LT(dark, 0.3f * lit);
  for (const float alpha : {0.3f, 0.6f})
    EXPECT_NEAR((floor(alpha) - dark) / (lit - dark), 1 - alpha, 0.07f) << alpha;
}

TEST(StageCloth, WeaveFadesToItsMeanFarAway) {
  // Threads a thousandth of a pixel wide: no pixel differs from the mean.
  Material woven = plain();
  woven.fabric.weave = Weave::plain;
  woven.fabric.thread = 3e-5f;
  woven.fabric.relief = 1;
  ClothStage fine(woven, {0, 0, 1}), none(plain(), {0, 0, 1});
  EXPECT_NEAR(center_pixel(fine.draw()).x(), center_pixel(none.draw()).x(), 0.01);
}

TEST(StageCloth, TornSheetHasItsNewTrianglesAndIsOpenBetween) {
  ClothStage s(plain(), {0, 0, 1});
  Sheet sheet(12);
  std::vector<uint32_t> left;
  for (std::size_t t = 0; t < sheet.triangles.size(); t += 3) {
    float x = 0;
    for (std::size_t k = 0; k < 3; ++k) x += sheet.points[sheet.triangles[t + k]].x() / 3;
    if (x < -0.4f)
      left.insert(left.end(), sheet.triangles.begin() + static_cast<std::ptrdiff_t>(t),
                  sheet.triangles.begin() + static_cast<std::ptrdiff_t>(t) + 3);
  }
  s.stage.set_cloth_mesh(s.cloth, left, sheet.uvs);
  EXPECT_EQ(center_pixel(s.draw()).w(), 0) << "the cloth is invisible until set_cloth() is called";
  s.stage.set_cloth(s.cloth, sheet.points);
  const HdrImage picture = s.draw();
  EXPECT_EQ(center_pixel(picture).w(), 0);
  EXPECT_EQ(pixel(picture, 36, 32).w(), 1);
}

// In a crumpled thick sheet one surface may be just in front of another; the hidden one must not be visible.
TEST(StageCloth, IsDrawnTheSameAfterAnyOtherPicture) {
  ClothStage s(plain(), {0.3f, 0.5f, 1});
  Sheet sheet(12);
  for (std::size_t i = 0; i < sheet.points.size(); ++i) {
    const auto k = static_cast<float>(i);
    sheet.points[i] += 0.25f * Vector3f(std::sin(7.1f * k), std::sin(11.3f * k), std::sin(5.7f * k));
  }
  const Environment sky{.intensity = 1, .visible = true};
  Environment bright = sky;
  bright.zenith = bright.horizon = {9, 0, 9};
  s.stage.set_cloth(s.cloth, sheet.points);
  s.stage.set_environment(sky);
  const HdrImage first = s.draw();
  for (std::size_t i = 3; i < first.rgba.size(); i += 4) ASSERT_EQ(first.rgba[i], 1) << "a hole at " << i / 4;
  s.stage.set_environment(bright);
  s.draw();
  s.stage.set_environment(sky);
  EXPECT_EQ(s.draw().rgba, first.rgba);
}

}  // namespace
}  // namespace offstage::render
