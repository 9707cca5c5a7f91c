/// Measures forces on particles: turbulence by itself, sub-steps of particles in turbulent air, and forces
/// between particles with and without a cut-off distance.

#include <cmath>

#include <benchmark/benchmark.h>

#include "effects/random.h"
#include "sim/dynamics/pair_forces.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr Real kForcesStep = 1.0 / 240;

Vec3 random_point(std::size_t i, Real size) {
  const effects::RandomStream random(1, 0);
  return size * Vec3(random.uniform(i, 0), random.uniform(i, 1), random.uniform(i, 2));
}

void rates(benchmark::State& state, const char* name) {
  state.SetItemsProcessed(state.iterations() * state.range(0));
  state.counters[name] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

/// Measures turbulence in one thread. Arguments: number of points, number of octaves.
void turbulence(benchmark::State& state) {
  std::vector<Real> x, v;
  for (std::size_t i = 0; i < static_cast<std::size_t>(state.range(0)); ++i) {
    const Vec3 p = random_point(i, 50);
    x.insert(x.end(), p.begin(), p.end());
  }
  v.resize(x.size());
  const Turbulence air{.octaves = static_cast<uint32_t>(state.range(1))};
  for (auto _ : state) {
    TurbulentFlow(air, 0.3).velocity(x, v);
    benchmark::DoNotOptimize(v.data());
  }
  rates(state, "fields/s");
}

/// Measures sub-steps of particles that fall far above the ground.
void step(benchmark::State& state, const std::vector<ForceDef>& forces) {
  World world({.max_step = kForcesStep});
  world.add_body({.name = "ground", .shape = Plane{}, .motion = MotionType::static_body});
  const auto system = world.add_particle_system({.linear_drag = 1e-3});
  for (std::size_t i = 0; i < static_cast<std::size_t>(state.range(0)); ++i)
    world.add_particle(system, {.position = random_point(i, 50) + Vec3(0, 500, 0), .mass = 0.001});
  for (ForceDef force : forces) {
    force.systems = {system};
    world.add_force(force);
  }
  for (auto _ : state) world.step(kForcesStep);
  rates(state, "substeps/s");
}
void with_drag(benchmark::State& state) {
  step(state, {});
}
void with_turbulence(benchmark::State& state) {
  step(state, {{.effect = Turbulence{.octaves = static_cast<uint32_t>(state.range(1))}}});
}
void with_three_fields(benchmark::State& state) {
  step(state, {{.effect = Turbulence{.octaves = 2}},
               {.effect = Vortex{.region = SphereRegion{{25, 525, 25}, 20}, .drop_rate = 1}},
               {.effect = WindField{.wind = {1, 0, 0}, .region = BoxRegion{{25, 525, 25}, {20, 20, 20}}}}});
}

/// Evaluates the forces once for particles as dense as a liquid. About 70 particles are within the cut-off
/// distance of each.
void pairs(benchmark::State& state, const ForceDef& def) {
  const auto count = static_cast<std::size_t>(state.range(0));
  std::vector<PairMember> members;
  std::vector<Real> x, dv(3 * count);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 p = random_point(i, std::cbrt(static_cast<Real>(count)));
    x.insert(x.end(), p.begin(), p.end());
    members.push_back({i, 1, 1});
  }
  PairForces forces;
  forces.add(def, std::move(members));
  for (auto _ : state) {
    forces.accelerate(x, dv);
    benchmark::DoNotOptimize(dv.data());
  }
  rates(state, "evaluations/s");
}
void gravitation_of_all(benchmark::State& state) {
  pairs(state, {.effect = MutualGravitation{}});
}
void lennard_jones_of_near(benchmark::State& state) {
  pairs(state, {.effect = LennardJones{.sigma = 1, .cut_off = 2.5}});
}

BENCHMARK(turbulence)->Args({1 << 16, 1})->Args({1 << 16, 2})->Args({1 << 16, 3});
BENCHMARK(with_drag)->Arg(1'000'000)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(with_turbulence)
    ->Args({10'000, 2})
    ->Args({100'000, 2})
    ->Args({1'000'000, 1})
    ->Args({1'000'000, 2})
    ->Args({1'000'000, 3})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(with_three_fields)->Arg(1'000'000)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(gravitation_of_all)
    ->RangeMultiplier(4)
    ->Range(1024, 16384)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(lennard_jones_of_near)
    ->RangeMultiplier(10)
    ->Range(1000, 1'000'000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace offstage::sim
