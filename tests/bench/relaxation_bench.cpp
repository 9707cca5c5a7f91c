/// Measures only the fast contact solver, without collision detection: colouring, set-up, all sub-steps and
/// the report. The bodies of the scenes are at rest. The second argument is the number of threads. Counters:
/// patches, points and the time per patch and sweep.

#include <benchmark/benchmark.h>
#include <oneapi/tbb/global_control.h>

#include "tests/box_scene.h"

namespace offstage::sim {
namespace {

constexpr Real kStep = 1.0 / 240;

void solve(benchmark::State& state, BoxScene scene, Real settle) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(state.range(1)));
  scene.run(settle, kStep);
  scene.prepare(kStep);
  const std::vector<RelaxedBody> bodies = scene.relaxed();
  uint64_t sweeps = 0;
  for (auto _ : state) {
    sweeps += scene.solve(kStep).iterations;
    state.PauseTiming();
    scene.relaxed() = bodies;
    state.ResumeTiming();
  }
  std::size_t points = 0;
  for (const ContactPatch& p : scene.patches()) points += p.count;
  const auto patches = static_cast<double>(scene.patches().size());
  state.counters["patches"] = patches;
  state.counters["points"] = static_cast<double>(points);
  state.counters["per_patch_sweep"] = benchmark::Counter(
      static_cast<double>(sweeps) * patches, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void pile(benchmark::State& state) {
  solve(state, box_pile(static_cast<int>(state.range(0))), 3);
}
void wall(benchmark::State& state) {
  solve(state, brick_wall(static_cast<int>(state.range(0))), 0.25);
}
void stack(benchmark::State& state) {
  solve(state, box_stack(static_cast<int>(state.range(0))), 0.25);
}

BENCHMARK(stack)->Args({10, 1})->Args({100, 1});
BENCHMARK(wall)->Args({100, 1})->Args({1000, 1})->Args({1000, 2})->UseRealTime();
BENCHMARK(pile)->Args({100, 1})->Args({1000, 1})->Args({1000, 2})->UseRealTime();

}  // namespace
}  // namespace offstage::sim
