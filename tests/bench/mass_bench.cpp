/// Mass properties and topology of a torus of 800 000 triangles, and its registration as a whole.

#include <cmath>
#include <numbers>

#include <benchmark/benchmark.h>

#include "sim/world.h"

namespace offstage::sim {
namespace {

TriangleMesh torus(uint32_t around, uint32_t across) {
  constexpr Real kTurn = 2 * std::numbers::pi;
  TriangleMesh mesh;
  for (uint32_t i = 0; i < around; ++i)
    for (uint32_t j = 0; j < across; ++j) {
      const Real u = kTurn * i / around, v = kTurn * j / across, r = 1 + 0.3 * std::cos(v);
      mesh.vertices.emplace_back(r * std::cos(u), 0.3 * std::sin(v), -r * std::sin(u));
    }
  for (uint32_t i = 0; i < around; ++i)
    for (uint32_t j = 0; j < across; ++j) {
      const uint32_t i1 = (i + 1) % around, j1 = (j + 1) % across;
      const uint32_t a = i * across + j, b = i1 * across + j, c = i1 * across + j1, d = i * across + j1;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  return mesh;
}

const TriangleMesh& big_torus() {
  static const TriangleMesh mesh = torus(1000, 400);
  return mesh;
}

void mass(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(mass_properties(big_torus()));
}

void topology(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(MeshTopology(big_torus()));
}

void registration(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(World().add_mesh(big_torus()));
}

BENCHMARK(mass)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(topology)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(registration)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace offstage::sim
