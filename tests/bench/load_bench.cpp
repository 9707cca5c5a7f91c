/// Compares the time to read a model with the time of assimp alone with the same post-processing. The
/// difference is the cost of the child process, the checks and the transfer.

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <benchmark/benchmark.h>
#include <unistd.h>

#include "render/mesh_io.h"

namespace offstage::render {
namespace {

/// Returns an OBJ of a wavy grid of n x n cells, with normals: 2 n^2 triangles.
std::filesystem::path grid_file(int n) {
  const auto path =
      std::filesystem::temp_directory_path() / ("offstage-grid-" + std::to_string(getpid()) + ".obj");
  std::ofstream out(path);
  char line[96];
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) {
      std::snprintf(line, sizeof line, "v %.5f %.5f %.5f\nvn 0 1 0\n", 0.01 * i,
                    0.05 * std::sin(0.1 * (i + j)), 0.01 * j);
      out << line;
    }
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const int a = i * (n + 1) + j + 1, b = a + 1, c = a + n + 1, d = c + 1;
      std::snprintf(line, sizeof line, "f %d//%d %d//%d %d//%d %d//%d\n", a, a, b, b, d, d, c, c);
      out << line;
    }
  return path;
}

void assimp_alone(benchmark::State& state) {
  const auto path = grid_file(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    Assimp::Importer importer;
    benchmark::DoNotOptimize(
        importer.ReadFile(path, aiProcess_Triangulate | aiProcess_JoinIdenticalVertices));
  }
  std::filesystem::remove(path);
}

void read_model_whole(benchmark::State& state) {
  const auto path = grid_file(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(read_model(path).parts.size());
  std::filesystem::remove(path);
}

BENCHMARK(assimp_alone)->Arg(400)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(read_model_whole)->Arg(400)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace offstage::render
