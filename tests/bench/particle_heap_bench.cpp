/// Measures particles that collide with each other: sub-steps per second of a column that collapses to a
/// heap, of a column at rest, and of a thin cloud in free flight, for several numbers of particles.

#include <cmath>

#include <benchmark/benchmark.h>

#include "effects/random.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr Real kHeapStep = 1.0 / 240, kRadius = 0.005;

void run_heap(benchmark::State& state, World& world, int warm_up) {
  for (int i = 0; i < warm_up; ++i) world.step(kHeapStep);
  uint64_t collisions = 0;
  for (auto _ : state) collisions += world.step(kHeapStep).particles.collisions;
  const auto steps = static_cast<double>(state.iterations());
  state.SetItemsProcessed(state.iterations() * state.range(0));
  state.counters["substeps/s"] = benchmark::Counter(steps, benchmark::Counter::kIsRate);
  state.counters["collisions"] =
      benchmark::Counter(static_cast<double>(collisions), benchmark::Counter::kAvgIterations);
}

/// Returns a world with particles on rough ground, in a slightly irregular lattice that is twice as high as
/// wide.
World column(std::size_t count) {
  World world({.max_step = kHeapStep});
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0});
  const auto system = world.add_particle_system({.internal = true});
  const effects::RandomStream random(1, 0);
  const auto side = static_cast<std::size_t>(std::ceil(std::cbrt(static_cast<Real>(count) / 2)));
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 cell(static_cast<Real>(i % side), static_cast<Real>(i / (side * side)),
                    static_cast<Real>(i / side % side));
    world.add_particle(system, {.position = 2.1 * kRadius * cell + Vec3(4e-4 * random.uniform(i, 0), 0.006,
                                                                        4e-4 * random.uniform(i, 1)),
                                .mass = 0.001,
                                .radius = kRadius,
                                .restitution = 0.2});
  }
  return world;
}

void heap_forming(benchmark::State& state) {
  World world = column(static_cast<std::size_t>(state.range(0)));
  run_heap(state, world, 48);
}
void heap_at_rest(benchmark::State& state) {
  World world = column(static_cast<std::size_t>(state.range(0)));
  run_heap(state, world, 720);
}

/// The particles fill a thousandth of the space.
void ballistic(benchmark::State& state) {
  World world({.max_step = kHeapStep});
  const auto system = world.add_particle_system({.internal = true});
  const effects::RandomStream random(1, 0);
  const auto count = static_cast<std::size_t>(state.range(0));
  const Real side = kRadius * std::cbrt(4'000 * static_cast<Real>(count));
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = [&](uint32_t k) { return random.uniform(i, k) - 0.5; };
    world.add_particle(system, {.position = side * Vec3(at(0), at(1), at(2)),
                                .velocity = 2 * Vec3(at(3), at(4), at(5)),
                                .mass = 0.001,
                                .radius = kRadius});
  }
  run_heap(state, world, 2);
}

BENCHMARK(heap_forming)
    ->Arg(10'000)
    ->Arg(100'000)
    ->Iterations(40)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(heap_at_rest)
    ->Arg(10'000)
    ->Arg(100'000)
    ->Iterations(20)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(ballistic)->Arg(10'000)->Arg(100'000)->Arg(1'000'000)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace offstage::sim
