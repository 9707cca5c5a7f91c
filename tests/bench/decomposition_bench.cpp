/// Measures convex decompositions: exact ones of tori with more and more reflex edges, and an approximate one
/// of a torus with a hole in its surface.

#include <benchmark/benchmark.h>

#include "sim/geometry/convex_decomposition.h"
#include "sim/geometry/winding_number.h"
#include "tests/meshes.h"

namespace offstage::sim {
namespace {

void decompose_mesh(benchmark::State& state, const TriangleMesh& mesh) {
  const MeshTopology topology(mesh);
  ConvexDecomposition d;
  for (auto _ : state) d = decompose(mesh, topology);
  state.counters["triangles"] = static_cast<double>(mesh.triangles.size());
  state.counters["parts"] = static_cast<double>(d.parts.size());
  state.counters["volume_error"] = d.volume_error;
}

void exact(benchmark::State& state) {
  const auto around = static_cast<uint32_t>(state.range(0));
  decompose_mesh(state, torus_mesh(1, 0.3, around, 2 * around / 3));
}

void approximate(benchmark::State& state) {
  const auto around = static_cast<uint32_t>(state.range(0));
  TriangleMesh torus = torus_mesh(1, 0.3, around, 2 * around / 3);
  torus.triangles.pop_back();
  decompose_mesh(state, torus);
}

/// The point is inside, far from all triangles.
void winding_number(benchmark::State& state) {
  const WindingNumber winding(torus_mesh(1, 0.3, 322, 107));
  for (auto _ : state) benchmark::DoNotOptimize(winding.at({0.95, 0.05, 0.1}));
}

BENCHMARK(exact)->Arg(12)->Arg(24)->Arg(48)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(approximate)->Arg(24)->Arg(228)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(winding_number);

}  // namespace
}  // namespace offstage::sim
