// Times of the renderer on one core at 1280x720: the first frame of a context, sub-frames, and
// post-processing.

#include <cmath>

#include <benchmark/benchmark.h>

#include "render/primitives.h"
#include "render/stage.h"
#include "render/tone_map.h"

namespace offstage::render {
namespace {

constexpr StageDef kStage{.width_px = 1280, .height_px = 720};

const bool kPinned = (pin_environment(0), true);

// Evenly spread numbers in [0, 1).
float spread(uint64_t i, double step) {
  const double x = static_cast<double>(i + 1) * step;
  return static_cast<float>(x - std::floor(x));
}

void set_the_ground(Stage& stage, Pattern pattern) {
  stage.set_camera({.eye = {0, 2.2f, 7}, .target = {0, 1, 0}});
  const MaterialHandle ground = stage.add_material({.pattern = pattern});
  stage.add_instance(stage.add_mesh(make_ground(1000)), ground);
}

// Two models of 25 000 triangles on a ground.
void set_models(Stage& stage) {
  set_the_ground(stage, Pattern::checker);
  const MeshHandle model = stage.add_mesh(make_sphere(1, 158));
  const MaterialHandle material = stage.add_material({.color = {0.7f, 0.2f, 0.1f, 1}, .roughness = 0.3f});
  for (const float x : {-1.3f, 1.3f}) {
    stage.set_transform(stage.add_instance(model, material), Eigen::Affine3f(Eigen::Translation3f(x, 1, 0)));
  }
}

void set_points(Stage& stage, const PointsDef& def, uint64_t count, const Vector3f& size, float radius) {
  std::vector<Point> values;
  for (uint64_t i = 0; i < count; ++i) {
    const Vector3f unit(spread(i, 0.8191725134), spread(i, 0.6710436067), spread(i, 0.5497004779));
    values.push_back({.position = (unit - Vector3f(0.5f, 0, 0.5f)).cwiseProduct(size),
                      .velocity = {0.2f, -8, 0},
                      .radius = radius,
                      .color = {0.9f, 0.95f, 1, 0.6f},
                      .id = i});
  }
  stage.set_points(stage.add_points(def), values);
}

template <class Set>
void time_draw(benchmark::State& state, Set&& set) {
  Context context;
  Stage stage(context, kStage);
  set(stage);
  HdrImage sum;
  stage.draw({}, sum);  // compiles the shader programs of the scene
  int i = 0;
  for (auto _ : state) stage.draw(sample_offsets(i++ % 16, 16), sum);
}

void BM_FirstFrame(benchmark::State& state) {
  for (auto _ : state) {
    Context context;
    Stage stage(context, kStage);
    if (state.range(0) != 0) set_models(stage);
    HdrImage sum;
    stage.draw({}, sum);
  }
}
BENCHMARK(BM_FirstFrame)->Arg(0)->Arg(1)->ArgName("models")->Unit(benchmark::kMillisecond)->Iterations(3);

void BM_DrawEmpty(benchmark::State& state) {
  time_draw(state, [](Stage&) {});
}
BENCHMARK(BM_DrawEmpty)->Unit(benchmark::kMillisecond);

void BM_DrawGround(benchmark::State& state) {
  time_draw(state, [&](Stage& stage) { set_the_ground(stage, static_cast<Pattern>(state.range(0))); });
}
BENCHMARK(BM_DrawGround)->DenseRange(0, 9)->ArgName("pattern")->Unit(benchmark::kMillisecond);

void BM_DrawModels(benchmark::State& state) {
  time_draw(state, set_models);
}
BENCHMARK(BM_DrawModels)->Unit(benchmark::kMillisecond);

void BM_DrawModelsInRain(benchmark::State& state) {
  time_draw(state, [](Stage& stage) {
    set_models(stage);
    set_points(stage, {.style = PointStyle::streak}, 20'000, {16, 6, 12}, 0.002f);
  });
}
BENCHMARK(BM_DrawModelsInRain)->Unit(benchmark::kMillisecond);

void BM_DrawSmoke(benchmark::State& state) {
  time_draw(state, [](Stage& stage) {
    set_the_ground(stage, Pattern::none);
    set_points(stage, {.softness = 1}, 3'000, {3, 3, 3}, 0.2f);
  });
}
BENCHMARK(BM_DrawSmoke)->Unit(benchmark::kMillisecond);

void BM_DrawSpheres(benchmark::State& state) {
  time_draw(state, [](Stage& stage) {
    set_the_ground(stage, Pattern::none);
    set_points(stage, {.style = PointStyle::sphere}, 20'000, {4, 2, 4}, 0.015f);
  });
}
BENCHMARK(BM_DrawSpheres)->Unit(benchmark::kMillisecond);

// A sheet of n by n cells, 4 m wide, draped over a ball of 1 m.
struct Drape {
  explicit Drape(int n) {
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i) {
        const Vector2f uv(4 * static_cast<float>(i) / static_cast<float>(n),
                          4 * static_cast<float>(j) / static_cast<float>(n));
        const float x = uv.x() - 2, z = uv.y() - 2, r = std::sqrt(x * x + z * z), around = std::atan2(z, x);
        const float on_ball = std::min(r, 1.6f), below = r - on_ball;
        const float out = 1.02f * std::sin(on_ball / 1.02f) + 0.1f * below * (1 + std::sin(14 * around));
        def.uvs.push_back(uv);
        points.emplace_back(out * std::cos(around), 1 + 1.02f * std::cos(on_ball / 1.02f) - 0.8f * below,
                            out * std::sin(around));
      }
    const auto at = [n](int i, int j) { return static_cast<uint32_t>(j * (n + 1) + i); };
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        for (const uint32_t v :
             {at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)})
          def.triangles.push_back(v);
    def.thickness = 0.02f;
  }
  ClothDef def;
  std::vector<Vector3f> points;
};

// Draws sub-frames of a moving cloth. Its surface is computed again for each sub-frame.
void BM_DrawCloth(benchmark::State& state) {
  Context context;
  Stage stage(context, kStage);
  set_the_ground(stage, Pattern::checker);
  const Drape drape(static_cast<int>(state.range(0)));
  const ClothHandle cloth = stage.add_cloth(drape.def, stage.add_material({.roughness = 0.9f}));
  HdrImage sum;
  int i = 0;
  const auto draw = [&] {
    stage.set_cloth(cloth, drape.points);
    stage.draw(sample_offsets(i++ % 16, 16), sum);
  };
  draw();  // compiles the shader programs of the scene
  for (auto _ : state) draw();
}
BENCHMARK(BM_DrawCloth)->Arg(60)->Arg(100)->Arg(200)->ArgName("cells")->Unit(benchmark::kMillisecond);

void BM_ToneMapAndEdges(benchmark::State& state) {
  Context context;
  Stage stage(context, kStage);
  set_models(stage);
  HdrImage sum;
  stage.draw({}, sum);
  for (auto _ : state) {
    Image image = tone_map(sum, {});
    if (state.range(0) != 0) filter_edges(image);
    benchmark::DoNotOptimize(image.rgba.data());
  }
}
BENCHMARK(BM_ToneMapAndEdges)->Arg(0)->Arg(1)->ArgName("edges")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace offstage::render
