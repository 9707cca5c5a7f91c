#include "render/paint_order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <tbb/global_control.h>

#include "tests/render/gl_fixture.h"

namespace offstage::render {
namespace {

const Vector3f kRedLight(1, 0, 0), kGreenLight(0, 1, 0), kBlueLight(0, 0, 1), kWhiteLight(1, 1, 1);

/// A stage without light: materials show their emission, particles their colour. Clearing it is faster than
/// creating another one, which would have to compile its shaders.
struct DarkStage : SmallStage {
  std::vector<PointsHandle> point_sets;
  std::vector<InstanceHandle> bodies;
  void clear() {
    for (const PointsHandle set : point_sets) stage.remove(set);
    for (const InstanceHandle body : bodies) stage.remove(body);
    point_sets.clear();
    bodies.clear();
  }

  explicit DarkStage(int width_px = 96, int height_px = 64) : SmallStage(width_px, height_px) {
    stage.set_sun({.intensity = 0, .shadows = false});
    stage.set_environment({.intensity = 0, .visible = false});
  }
  void add_particle(PointStyle style, const Vector3f& position, const Vector3f& color, float alpha,
                    bool additive = false, float radius = 0.6f) {
    add_particles(style,
                  std::array{Point{.position = position,
                                   .velocity = {0, 0, 0},
                                   .radius = radius,
                                   .color = (Vector4f() << color, alpha).finished(),
                                   .id = 7}},
                  additive);
  }
  void add_particles(PointStyle style, std::span<const Point> points, bool additive = false) {
    const PointsHandle set = stage.add_points(
        {.style = style, .additive = additive, .lit = false, .casts_shadow = false, .softness = 0.01f});
    stage.set_points(set, points);
    point_sets.push_back(set);
  }
  InstanceHandle add_pane(const Vector3f& position, const Vector3f& color, float alpha = 0.5f, float turn = 0,
                          const Vector3f& size = {8, 8, 0.02f}) {
    Material look{.roughness = 1, .emission = color};
    look.color = {0, 0, 0, alpha};
    const InstanceHandle pane = add(make_box(size), look, position);
    stage.set_transform(pane, Eigen::Translation3f(position) * Eigen::AngleAxisf(turn, Vector3f::UnitY()));
    bodies.push_back(pane);
    return pane;
  }
  InstanceHandle add_glass(const Mesh& mesh, const Vector3f& position, const Vector3f& glow = {0, 0, 0}) {
    Material look{.roughness = 0.05f, .emission = glow, .transmission = 1, .refraction = 1.01f};
    look.color = {1, 1, 1, 1};
    return bodies.emplace_back(add(mesh, look, position));
  }
  Vector3f center() { return center_pixel(draw()).head<3>(); }
};

struct Veil {
  Vector3f color;
  float alpha;
};
/// Returns the colour of translucent layers, the nearest first.
Vector3f over(std::initializer_list<Veil> layers) {
  Vector3f sum(0, 0, 0);
  float through = 1;
  for (const Veil& layer : layers) {
    sum += through * layer.alpha * layer.color;
    through *= 1 - layer.alpha;
  }
  return sum;
}

TEST(PaintOrder, SpritesAndFlakesOfTwoSystemsAreSortedByDepth) {
  DarkStage s;
  for (const bool near_first : {true, false})
    for (const PointStyle style : {PointStyle::sprite, PointStyle::flake}) {
      s.clear();
      if (near_first) s.add_particle(style, {0, 0, 1}, kRedLight, 0.9f);
      s.add_particle(style, {0, 0, -1}, kGreenLight, 0.9f);
      if (!near_first) s.add_particle(style, {0, 0, 1}, kRedLight, 0.9f);
      EXPECT_LT((s.center() - over({{kRedLight, 0.9f}, {kGreenLight, 0.9f}})).norm(), 0.01f) << near_first;
    }
}

TEST(PaintOrder, ParticlesAreSeenThroughThePanesInFrontOfThemAndNoOthers) {
  DarkStage s;
  for (const PointStyle style : {PointStyle::sprite, PointStyle::flake, PointStyle::streak})
    for (const float turn : {0.0f, 0.9f, -0.9f}) {
      s.clear();
      s.add_particle(style, {0, 0, 1}, kRedLight, 0.4f);
      s.add_pane({0, 0, 0.5f}, kWhiteLight, 0.3f, turn);
      s.add_particle(style, {0, 0, 0}, kGreenLight, 0.4f);
      s.add_pane({0, 0, -0.5f}, kRedLight, 0.3f, turn);
      s.add_particle(style, {0, 0, -1}, kBlueLight, 0.4f);
      const Vector3f expected = over({{kRedLight, 0.4f},
                                      {kWhiteLight, 0.3f},
                                      {kGreenLight, 0.4f},
                                      {kRedLight, 0.3f},
                                      {kBlueLight, 0.4f}});
      EXPECT_LT((s.center() - expected).norm(), 0.02f) << static_cast<int>(style) << ' ' << turn;
    }
}

TEST(PaintOrder, LargePaneInFrontOfASmallOneCoversIt) {
  DarkStage s;
  s.add_pane({0, 0, 0}, kGreenLight, 0.5f, 0, {60, 60, 0.02f});
  s.add_pane({0, 0, -1}, kBlueLight, 0.5f, 0, {0.5f, 0.5f, 0.02f});
  EXPECT_LT((s.center() - over({{kGreenLight, 0.5f}, {kBlueLight, 0.5f}})).norm(), 0.01f);
}

TEST(PaintOrder, SmokeSpritesAndStreaksCoverEachOtherByDepth) {
  constexpr std::array kStyles = {PointStyle::smoke, PointStyle::sprite, PointStyle::streak,
                                  PointStyle::flake};
  DarkStage s;
  for (const PointStyle front : kStyles)
    for (const PointStyle back : kStyles) {
      if (front == back) continue;
      const auto shown = [&](bool with_front, bool with_back, bool front_first) {
        s.clear();
        if (with_front && front_first) s.add_particle(front, {0, 0, 1}, kRedLight, 0.8f);
        if (with_back) s.add_particle(back, {0, 0, -1}, kGreenLight, 0.8f);
        if (with_front && !front_first) s.add_particle(front, {0, 0, 1}, kRedLight, 0.8f);
        return center_pixel(s.draw());
      };
      const Vector4f front_alone = shown(true, false, true), back_alone = shown(false, true, true);
      ASSERT_GT(front_alone.w(), 0.2f);
      for (const bool front_first : {true, false}) {
        const Vector4f expected = front_alone + (1 - front_alone.w()) * back_alone;
        EXPECT_LT((shown(true, true, front_first) - expected).norm(), 0.02f)
            << static_cast<int>(front) << ' ' << static_cast<int>(back);
      }
    }
}

TEST(PaintOrder, AddedLightIsDimmedOnlyByLayersInFront) {
  DarkStage s;
  for (const PointStyle style : {PointStyle::sprite, PointStyle::streak})
    for (const bool additive_in_front : {true, false}) {
      s.clear();
      const float z = additive_in_front ? 1.0f : -1.0f;
      s.add_particle(style, {0, 0, z}, kRedLight, 0.5f, true);
      s.add_particle(PointStyle::sprite, {0, 0, 0}, kGreenLight, 0.8f);
      const float dimmed = additive_in_front ? 1.0f : 0.2f;
      EXPECT_LT((s.center() - Vector3f(0.5f * dimmed, 0.8f, 0)).norm(), 0.02f);
    }
}

TEST(PaintOrder, EveryKindOfParticleIsSeenThroughGlassBehindItAndInIt) {
  DarkStage s;
  for (const PointStyle style :
       {PointStyle::smoke, PointStyle::sprite, PointStyle::streak, PointStyle::flake})
    for (const bool ball : {true, false}) {
      const auto shown = [&](bool with_glass, float z) {
        s.clear();
        // Apart from the glass, the particle is the first and the last in depth.
        if (with_glass)
          s.add_glass(ball ? make_sphere(1) : make_box({2, 2, 2}), {0, 0, 0}, 0.1f * kBlueLight);
        s.add_particle(style, {0, 0, z}, kRedLight, 0.9f, false, 0.3f);
        return s.center();
      };
      for (const float z : {-2.0f, 0.0f, 2.0f})
        EXPECT_GT(shown(true, z).x(), 0.8f * shown(false, z).x()) << static_cast<int>(style) << ' ' << z;
      // The emission of the glass covers particles behind it and inside it.
      EXPECT_GT(shown(true, -2).z(), 0.09f);
      EXPECT_GT(shown(true, 0).z(), 0.09f);
      EXPECT_LT(shown(true, 2).z(), 0.06f) << static_cast<int>(style);
    }
}

TEST(PaintOrder, GlassIsSeenThroughGlass) {
  DarkStage s;
  for (const bool near_first : {true, false}) {
    s.clear();
    const Mesh slab = make_box({2, 2, 0.2f});
    if (near_first) s.add_glass(slab, {0, 0, 1}, 0.2f * kRedLight);
    s.add_glass(slab, {0, 0, -1}, 0.5f * kGreenLight);
    if (!near_first) s.add_glass(slab, {0, 0, 1}, 0.2f * kRedLight);
    s.add_particle(PointStyle::streak, {0, 0, -2}, kBlueLight, 1);
    const Vector3f center = s.center();
    EXPECT_NEAR(center.x(), 0.2f, 0.02f);
    EXPECT_GT(center.y(), 0.4f);
    EXPECT_GT(center.z(), 0.8f);
  }
}

TEST(PaintOrder, TranslucentClothCoversOnlyParticlesBehindIt) {
  // A wavy sheet: particles in its bounding box are in front of it or behind it, depending on the surface.
  constexpr int n = 40;
  std::vector<Vector3f> places;
  std::vector<Vector2f> uvs;
  std::vector<uint32_t> triangles;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const Vector2f uv(4.0f * static_cast<float>(i) / n, 4.0f * static_cast<float>(j) / n);
      uvs.push_back(uv);
      places.emplace_back(uv.x() - 2, uv.y() - 2,
                          0.5f * std::cos(0.5f * std::numbers::pi_v<float> * (uv.x() - 2)));
    }
  for (uint32_t j = 0; j < n; ++j)
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t a = j * (n + 1) + i, b = a + 1, c = b + n + 1, d = a + n + 1;
      triangles.insert(triangles.end(), {a, b, c, a, c, d});
    }
  Material voile{.roughness = 1, .emission = kGreenLight};
  voile.color = {0, 0, 0, 0.4f};
  voile.fabric = {.weave = Weave::none, .sheen = 0, .translucency = 0};
  // The sheet is at z = 0.5 for x = 0, and at z = -0.5 for x = 2.
  DarkStage s;
  const MaterialHandle material = s.stage.add_material(voile);
  const auto shown = [&](float x, float z, bool with_cloth, bool with_particle) {
    s.clear();
    const ClothHandle cloth = s.stage.add_cloth({.triangles = triangles, .uvs = uvs}, material);
    if (with_cloth) s.stage.set_cloth(cloth, places);
    if (with_particle) s.add_particle(PointStyle::sprite, {x, 0, z}, kRedLight, 0.9f, false, 0.15f);
    const Vector2f at = project({.eye = {0, 0, 5}, .target = {0, 0, 0}}, {x, 0, z}, 96, 64);
    const HdrImage picture = s.draw();
    s.stage.remove(cloth);
    return pixel(picture, static_cast<int>(at.x()), static_cast<int>(at.y()));
  };
  for (const auto& [x, z, in_front] : {std::tuple(0.0f, 1.0f, true), std::tuple(0.0f, 0.0f, false),
                                       std::tuple(0.0f, -1.0f, false), std::tuple(1.6f, 0.2f, true)}) {
    const Vector4f cloth = shown(x, z, true, false), particle = shown(x, z, false, true);
    ASSERT_GT(cloth.w(), 0.3f);
    ASSERT_LT(cloth.w(), 0.7f);
    const Vector4f expected =
        in_front ? particle + (1 - particle.w()) * cloth : cloth + (1 - cloth.w()) * particle;
    EXPECT_LT((shown(x, z, true, true) - expected).norm(), 0.03f) << x << ' ' << z;
  }
}

TEST(PaintOrder, RainDrawnInPartsLooksAsDrawnAtOnce) {
  const auto rain = [](bool parts) {
    DarkStage s(200, 150);
    std::vector<Point> drops;
    for (uint64_t i = 0; i < 3000; ++i) {
      const auto spread = [i](double step) {
        const double x = static_cast<double>(i + 1) * step;
        return static_cast<float>(x - std::floor(x)) - 0.5f;
      };
      drops.push_back({.position = {6 * spread(0.7548), 5 * spread(0.5698), 6 * spread(0.8192)},
                       .velocity = {1, -9, 0.5f},
                       .radius = 0.01f,
                       .color = {spread(0.671) + 0.5f, 1, 0.5f, 0.6f},
                       .id = i});
    }
    s.add_particles(PointStyle::streak, drops);
    for (int k = 0; parts && k < 5; ++k)  // too faint to be drawn, but they divide the particles into parts
      s.add_pane({0.3f * static_cast<float>(k), 0, 1.0f - static_cast<float>(k)}, kWhiteLight, 0.001f, 0.4f,
                 {1.5f, 2, 0.05f});
    return s.draw();
  };
  const HdrImage at_once = rain(false), in_parts = rain(true);
  float worst = 0;
  for (std::size_t i = 0; i < at_once.rgba.size(); ++i)
    worst = std::max(worst, std::abs(at_once.rgba[i] - in_parts.rgba[i]));
  EXPECT_LT(worst, 2e-3f);  // error of skipping particles behind a nearly opaque tile
}

View view_from(const Vector3f& eye) {
  return make_view({.eye = eye, .target = {0, 0, 0}}, {}, 96, 64);
}

TEST(PaintOrder, RunsAreBoundedForAnyOrderOfKindsAndKeepTheOrderOfEachKind) {
  const auto points = [](float first, int n) {
    std::vector<Point> result;
    for (int i = 0; i < n; ++i)
      result.push_back({.position = {0, 0, first - 0.004f * static_cast<float>(i)},
                        .velocity = {0, 0, 0},
                        .radius = 0.1f,
                        .color = {1, 1, 1, 1},
                        .id = static_cast<uint64_t>(i)});
    return result;
  };
  std::array<PointSet, 3> sets;
  sets[0].def.style = PointStyle::smoke;
  sets[1].def.style = PointStyle::sprite;
  sets[2].def.style = PointStyle::streak;
  for (std::size_t k = 0; k < sets.size(); ++k) sets[k].assign(points(0.001f * static_cast<float>(k), 1000));
  const std::array pointers = {&sets[0], &sets[1], &sets[2]};
  PaintOrder order;
  const View view = view_from({0, 0, 5});
  order.build(std::vector<const PointSet*>(pointers.begin(), pointers.end()), {}, view);
  EXPECT_LE(order.run_count(), 24u);
  EXPECT_GE(order.run_count(), 9u);
  std::array<uint32_t, PaintOrder::kKinds> next = {1000, 1000, 0, 1000};
  for (const PaintOrder::Run& run : order.runs_before(0)) {
    uint32_t& last = next[static_cast<std::size_t>(run.kind)];
    EXPECT_EQ(run.last, last);  // every particle occurs once, from back to front
    last = run.first;
  }
  EXPECT_EQ(next, (std::array<uint32_t, PaintOrder::kKinds>{0, 0, 0, 0}));
}

TEST(PaintOrder, BodiesHidePointsBehindTheirBackFaces) {
  const View view = view_from({0, 0, 5});
  const auto hides = [&](const Region& region, const Vector3f& p) {
    return region.hides(p, view.depth_of(p));
  };
  const Eigen::AlignedBox3f pane(Vector3f(-4, -4, -0.01f), Vector3f(4, 4, 0.01f));
  const Region slanting(pane, Eigen::Affine3f(Eigen::AngleAxisf(0.8f, Vector3f::UnitY())), false, view);
  // The right side of the pane is farther away: its plane is z = -x tan(0.8).
  EXPECT_FALSE(hides(slanting, {2, 0, -1.9f}));
  EXPECT_TRUE(hides(slanting, {2, 0, -2.3f}));
  EXPECT_FALSE(hides(slanting, {-1, 0, 1.2f}));
  EXPECT_TRUE(hides(slanting, {-1, 0, 0.9f}));
  const Region ball({Vector3f(-1, -1, -1), Vector3f(1, 1, 1)}, Eigen::Affine3f::Identity(), true, view);
  EXPECT_TRUE(hides(ball, {0, 0, 0}));
  EXPECT_TRUE(hides(ball, {0.9f, 0, -0.6f}));
  EXPECT_FALSE(hides(ball, {0.7f, 0, 0.9f}));  // in front of the ball, inside its bounding box
  EXPECT_FALSE(hides(ball, {0, 0, 1.01f}));
}

}  // namespace
}  // namespace offstage::render
