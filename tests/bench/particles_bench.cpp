/// Measures particles with gravity and drag that bounce on a plane, and on a mesh in turbulent air: sub-steps
/// per second, and the number of particles in contact.

#include <benchmark/benchmark.h>

#include "effects/random.h"
#include "sim/world.h"
#include "tests/meshes.h"

namespace offstage::sim {
namespace {

constexpr Real kParticlesStep = 1.0 / 240;

/// Returns a world with `count` particles above a plane. `height`: height from which they fall.
World rain(std::size_t count, Real height, ParticleSystemHandle& system) {
  World world({.max_step = kParticlesStep});
  world.add_body({.name = "ground", .shape = Plane{}, .motion = MotionType::static_body});
  system = world.add_particle_system({.name = "rain", .linear_drag = 1e-5});
  const effects::RandomStream random(1, 0);
  for (std::size_t i = 0; i < count; ++i)
    world.add_particle(system, {.position = {10 * random.uniform(i, 0), 0.02 + height * random.uniform(i, 1),
                                             10 * random.uniform(i, 2)},
                                .mass = 0.001,
                                .radius = 0.005});
  return world;
}

void time_steps(benchmark::State& state, World& world, int warm_up) {
  for (int i = 0; i < warm_up; ++i) world.step(kParticlesStep);
  uint64_t collisions = 0;
  for (auto _ : state) collisions += world.step(kParticlesStep).particles.collisions;
  state.SetItemsProcessed(state.iterations() * state.range(0));
  state.counters["substeps/s"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  state.counters["collisions"] =
      benchmark::Counter(static_cast<double>(collisions), benchmark::Counter::kAvgIterations);
}

void run_particles(benchmark::State& state, Real height, int warm_up) {
  ParticleSystemHandle system;
  World world = rain(static_cast<std::size_t>(state.range(0)), height, system);
  time_steps(state, world, warm_up);
}

void falling(benchmark::State& state) {
  run_particles(state, 100, 0);
}
void bouncing(benchmark::State& state) {
  run_particles(state, 1, 60);
}
void at_rest(benchmark::State& state) {
  run_particles(state, 0, 480);
}

/// Particles move in turbulence with eddies of two sizes, past a torus of 18 432 triangles.
void on_mesh_in_eddies(benchmark::State& state) {
  ParticleSystemHandle system;
  World world = rain(static_cast<std::size_t>(state.range(0)), 5, system);
  world.add_body({.name = "torus",
                  .shape = MeshShape{world.add_mesh(torus_mesh(2, 0.8, 144, 64))},
                  .motion = MotionType::static_body,
                  .pose = {.position = {5, 2.5, 5}}});
  world.add_force(
      {.systems = {system}, .effect = Turbulence{.speed = 3, .scale = 2, .octaves = 2, .drag = 1e-3}});
  time_steps(state, world, 24);
}

BENCHMARK(falling)->Arg(1'000'000)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(bouncing)->Arg(1'000'000)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(at_rest)->Arg(1'000'000)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(on_mesh_in_eddies)
    ->RangeMultiplier(10)
    ->Range(10'000, 1'000'000)
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace offstage::sim
