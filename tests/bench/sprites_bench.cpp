// Times of drawing many particles at 1280x720: puffs of smoke, drops, flakes, and the glow of lights.

#include <cmath>

#include <benchmark/benchmark.h>

#include "render/bloom.h"
#include "render/primitives.h"
#include "render/stage.h"

namespace offstage::render {
namespace {

const bool kSpritesPinned = (pin_environment(2), true);

float spread_sprites(uint64_t i, double step) {
  const double x = static_cast<double>(i + 1) * step;
  return static_cast<float>(x - std::floor(x));
}

// Draws one sub-frame of `count` particles in a box of `size` above the ground.
void time_points(benchmark::State& state, const PointsDef& def, const Vector3f& size, float radius,
                 float alpha) {
  Context context;
  Stage stage(context, {.width_px = 1280, .height_px = 720});
  stage.set_camera({.eye = {0, 2.6f, 9.5f}, .target = {0, 2.2f, 0}, .fov_deg = 32});
  stage.add_instance(stage.add_mesh(make_ground(1000)), stage.add_material({.pattern = Pattern::checker}));
  std::vector<Point> values;
  for (uint64_t i = 0; i < static_cast<uint64_t>(state.range(0)); ++i) {
    const Vector3f unit(spread_sprites(i, 0.8191725134) - 0.5f, spread_sprites(i, 0.6710436067),
                        spread_sprites(i, 0.5497004779) - 0.5f);
    values.push_back({.position = unit.cwiseProduct(size),
                      .velocity = {0.2f, -8, 0},
                      .radius = radius,
                      .color = {0.7f, 0.7f, 0.7f, alpha},
                      .id = i});
  }
  const PointsHandle points = stage.add_points(def);
  HdrImage sum;
  stage.set_points(points, values);
  stage.draw({}, sum);  // compiles the shader programs of the scene
  for (auto _ : state) {
    stage.set_points(points, values);
    stage.draw({}, sum);
  }
}

void BM_Smoke(benchmark::State& state) {
  time_points(state, {.style = PointStyle::smoke}, {1.5f, 4.5f, 1.5f}, 0.1f, 0.08f);
}
void BM_Fire(benchmark::State& state) {
  time_points(state, {.style = PointStyle::fire}, {1.5f, 2, 1.5f}, 0.1f, 0.3f);
}
void BM_Rain(benchmark::State& state) {
  time_points(state, {.style = PointStyle::streak, .casts_shadow = false}, {14, 9, 14}, 0.0022f, 0.8f);
}
void BM_Drops(benchmark::State& state) {
  time_points(state, {.style = PointStyle::streak}, {5, 4, 5}, 0.008f, 0.8f);
}
void BM_Flakes(benchmark::State& state) {
  time_points(state, {.style = PointStyle::flake, .casts_shadow = false}, {14, 7, 14}, 0.006f, 0.9f);
}
#define SPRITES_BENCH(name)                                                                      \
  BENCHMARK(name)->Arg(0)->Arg(1'000)->Arg(10'000)->Arg(100'000)->MeasureProcessCPUTime()->Unit( \
      benchmark::kMillisecond)
SPRITES_BENCH(BM_Smoke)->Arg(1'000'000);
SPRITES_BENCH(BM_Fire);
SPRITES_BENCH(BM_Rain);
SPRITES_BENCH(BM_Drops);
SPRITES_BENCH(BM_Flakes);

void BM_Bloom(benchmark::State& state) {
  HdrImage sum{1280, 720, std::vector<float>(1280 * 720 * 4, 0.5f)};
  for (std::size_t i = 0; i < sum.rgba.size() && state.range(0) != 0; i += 4004) sum.rgba[i] = 30;
  for (auto _ : state) add_bloom(sum, {});
}
BENCHMARK(BM_Bloom)->Arg(0)->Arg(1)->ArgName("lights")->MeasureProcessCPUTime()->Unit(
    benchmark::kMillisecond);

}  // namespace
}  // namespace offstage::render
