/// Particles created per second: by an emitter of a million particles per second with random parameters on
/// each surface, and by trails. The world only stores them.

#include <benchmark/benchmark.h>

#include "effects/emitter.h"
#include "effects/trail.h"

namespace offstage::effects {
namespace {

constexpr Real kEmitterStep = 1.0 / 240;

/// Emits a million particles per second from a surface. Arguments: kind of the surface; 0 for single
/// particles, 1 for a burst in each sub-step.
void emission(benchmark::State& state) {
  const auto kind = static_cast<SurfaceKind>(state.range(0));
  const sim::TriangleMesh tetrahedron{{{0, 0, 0}, {9, 0, 0}, {0, 9, 0}, {0, 0, 9}},
                                      {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
  const bool single = state.range(1) == 0;
  uint64_t created = 0;
  for (auto _ : state) {
    state.PauseTiming();
    sim::World world;
    const auto system = world.add_particle_system({});
    Emitter emitter(
        {.surface = {.kind = kind, .size = {5, 5}, .radius = 3, .mesh = tetrahedron},
         .release = {.rate = single ? 1e6 : 0.0, .count = single ? 0.0 : 4167.0, .interval = kEmitterStep},
         .particles = {.speed = Normal{5, 2},
                       .spread_deg = Normal{0, 20},
                       .radius = Normal{0.01, 0.005},
                       .lifespan = Normal{5, 2},
                       .restitution = Uniform{0.1, 0.5},
                       .friction = Uniform{0.1, 0.5},
                       .charge = Normal{0, 1e-6},
                       .max_alive = 100'000'000}},
        system);
    state.ResumeTiming();
    for (int i = 0; i < 120; ++i) emitter.emit(world, i * kEmitterStep, (i + 1) * kEmitterStep);
    created += emitter.report().released;
  }
  state.counters["particles/s"] =
      benchmark::Counter(static_cast<double>(created), benchmark::Counter::kIsRate);
}

/// Simulates ten thousand particles, each of which leaves a trail of a hundred particles per second.
void trails(benchmark::State& state) {
  uint64_t created = 0;
  for (auto _ : state) {
    state.PauseTiming();
    sim::World world;
    const auto stars = world.add_particle_system({}), target = world.add_particle_system({});
    for (int i = 0; i < 10'000; ++i)
      world.add_particle(stars, {.position = {0, 100, 0.1 * i}, .velocity = {9, 9, 0}});
    Trail trail({.release = {.rate = 100.0},
                 .particles = {.speed = 0.0, .radius = 0.005, .lifespan = 1.0, .max_alive = 100'000'000}},
                stars, target);
    world.step(kEmitterStep, [&](Real start, Real end) { trail.emit(world, start, end); });
    state.ResumeTiming();
    for (int i = 1; i < 60; ++i) trail.emit(world, kEmitterStep, 2 * kEmitterStep);
    created += trail.report().released;
  }
  state.counters["particles/s"] =
      benchmark::Counter(static_cast<double>(created), benchmark::Counter::kIsRate);
}

BENCHMARK(emission)
    ->ArgNames({"surface", "burst"})
    ->ArgsProduct({{0, 1, 2, 3}, {0, 1}})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(trails)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace offstage::effects
