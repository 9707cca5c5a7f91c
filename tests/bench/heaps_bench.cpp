/// Measures the steps of falling heaps with the solver `auto`: mean and greatest CPU time of a step in the
/// first four seconds.

#include <algorithm>
#include <ctime>

#include <benchmark/benchmark.h>

#include "tests/heap_scenes.h"

namespace offstage::sim {
namespace {

double cpu_ms() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

void heap_step(benchmark::State& state) {
  const Heap heap = kHeaps[static_cast<std::size_t>(state.range(0))];
  World world = heap_scene(heap);
  double worst = 0;
  for (auto _ : state) {
    const double before = cpu_ms();
    world.step(1.0 / 240);
    worst = std::max(worst, cpu_ms() - before);
  }
  state.SetLabel(name_of(heap));
  state.counters["worst_ms"] = worst;
}

BENCHMARK(heap_step)->DenseRange(0, 3)->Iterations(960)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace offstage::sim
