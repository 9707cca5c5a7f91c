/// Bounding trees: building them for 871 000 triangles, and the queries of two bumpy spheres of 69 000
/// triangles each, against FCL's OBBRSS trees on the same data. The spheres overlap, just touch, or are 1 %
/// of their radius apart, as the arguments say.

#include <cmath>
#include <memory>

#include <benchmark/benchmark.h>
#include <fcl/fcl.h>

#include "tests/mesh_pair.h"
#include "tests/meshes.h"

namespace offstage::sim {
namespace {

/// Returns a bumpy sphere with 2 `around` (`rings` - 1) triangles.
TriangleMesh bumpy_sphere(uint32_t around, uint32_t rings) {
  TriangleMesh mesh = sphere_mesh(1, around, rings);
  for (Vec3& v : mesh.vertices)
    v *= 1 + 0.02 * std::sin(25 * v.x()) * std::sin(25 * v.y()) * std::sin(25 * v.z());
  return mesh;
}

const TriangleMesh& contact_mesh() {
  static const TriangleMesh mesh = bumpy_sphere(263, 132);
  return mesh;
}

const TriangleMesh& big_mesh() {
  static const TriangleMesh mesh = bumpy_sphere(934, 467);
  return mesh;
}

template <class Volume>
const BoundingTree<Volume>& contact_tree(TreeSplit split) {
  static const BoundingTree<Volume> mean(contact_mesh(), TreeSplit::mean),
      area(contact_mesh(), TreeSplit::surface_area);
  return split == TreeSplit::mean ? mean : area;
}

const AabbTree& any_tree() {
  return contact_tree<Aabb>(TreeSplit::surface_area);
}

/// Returns the pose of the second sphere at which the surfaces are `gap` apart, to 1e-9 m.
Pose placed(Real gap) {
  static const Pose touching = [] {
    Pose pose{Vec3(3, 0.3, 0.2), Quat(0.8, 0.1, 0.5, -0.2).normalized()};
    const MeshTree<Aabb> m{contact_mesh(), any_tree()};
    std::optional<TrianglePair> last;
    for (Real distance = 1; distance > 1e-9;) {
      const auto closest = closest_triangles(m, m, pose, last);
      last = closest->triangles;
      distance = std::sqrt(closest->points.squared_distance);
      pose.position -= distance * pose.position.normalized();
    }
    return pose;
  }();
  return {touching.position + gap * touching.position.normalized(), touching.orientation};
}

enum Situation { kPressed, kTouching, kSeparated };

Pose situation(int64_t which) {
  return placed(which == kPressed ? -0.03 : which == kTouching ? -1e-6 : 0.01);
}

template <class Volume>
void build(benchmark::State& state) {
  const auto split = static_cast<TreeSplit>(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(BoundingTree<Volume>(big_mesh(), split));
}

template <class Volume>
void refit(benchmark::State& state) {
  BoundingTree<Volume> tree(big_mesh());
  for (auto _ : state) tree.refit(big_mesh());
}

template <class Volume>
void all_pairs(benchmark::State& state) {
  const auto& tree = contact_tree<Volume>(static_cast<TreeSplit>(state.range(1)));
  const MeshTree<Volume> m{contact_mesh(), tree};
  const Pose pose = situation(state.range(0));
  std::vector<TrianglePair> pairs;
  for (auto _ : state) {
    pairs.clear();
    intersecting_triangles(m, m, pose, pairs);
  }
  state.counters["pairs"] = static_cast<double>(pairs.size());
}

template <class Volume>
void any_pair(benchmark::State& state) {
  const auto& tree = contact_tree<Volume>(static_cast<TreeSplit>(state.range(1)));
  const MeshTree<Volume> m{contact_mesh(), tree};
  const Pose pose = situation(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(surfaces_intersect(m, m, pose));
}

template <class Volume>
void distance(benchmark::State& state) {
  const auto& tree = contact_tree<Volume>(static_cast<TreeSplit>(state.range(1)));
  const MeshTree<Volume> m{contact_mesh(), tree};
  const Pose pose = situation(state.range(0));
  Real d = 0;
  for (auto _ : state) d = std::sqrt(closest_triangles(m, m, pose)->points.squared_distance);
  state.counters["distance"] = d;
}

template <class Volume>
void warm_distance(benchmark::State& state) {
  const auto& tree = contact_tree<Volume>(static_cast<TreeSplit>(state.range(1)));
  const MeshTree<Volume> m{contact_mesh(), tree};
  const Pose pose = situation(state.range(0));
  const auto start = closest_triangles(m, m, pose)->triangles;
  for (auto _ : state) benchmark::DoNotOptimize(closest_triangles(m, m, pose, start));
}

using FclTree = fcl::BVHModel<fcl::OBBRSSd>;

std::shared_ptr<FclTree> fcl_tree(const TriangleMesh& mesh) {
  auto tree = std::make_shared<FclTree>();
  tree->beginModel(static_cast<int>(mesh.triangles.size()), static_cast<int>(mesh.vertices.size()));
  std::vector<fcl::Triangle> triangles;
  for (const auto& [a, b, c] : mesh.triangles) triangles.emplace_back(a, b, c);
  tree->addSubModel(mesh.vertices, triangles);
  tree->endModel();
  return tree;
}

struct FclPair {
  explicit FclPair(const Pose& pose) : a(model()), b(model()) {
    b.setTransform(pose.orientation, pose.position);
    b.computeAABB();
  }
  static std::shared_ptr<FclTree> model() {
    static const auto tree = fcl_tree(contact_mesh());
    return tree;
  }
  fcl::CollisionObjectd a, b;
};

void fcl_build(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(fcl_tree(big_mesh()));
}

/// With `contacts`, FCL also computes points and normals for each pair, which this engine does not do here.
void fcl_collide(benchmark::State& state, std::size_t most, bool contacts) {
  const FclPair pair(situation(state.range(0)));
  std::size_t count = 0;
  for (auto _ : state) {
    fcl::CollisionResultd result;
    fcl::collide(&pair.a, &pair.b, fcl::CollisionRequestd(most, contacts), result);
    count = result.numContacts();
  }
  state.counters["pairs"] = static_cast<double>(count);
}

void fcl_mesh_distance(benchmark::State& state) {
  const FclPair pair(situation(state.range(0)));
  double d = 0;
  for (auto _ : state) {
    fcl::DistanceResultd result;
    d = fcl::distance(&pair.a, &pair.b, fcl::DistanceRequestd(true), result);
  }
  state.counters["distance"] = d;
}

constexpr std::size_t kAll = 10'000'000;

void queries(benchmark::internal::Benchmark* b) {
  b->Unit(benchmark::kMicrosecond)->ArgsProduct({{kPressed, kTouching}, {0, 1}});
}
void apart(benchmark::internal::Benchmark* b) {
  b->Unit(benchmark::kMicrosecond)->ArgsProduct({{kSeparated}, {0, 1}});
}
void builds(benchmark::internal::Benchmark* b) {
  b->Unit(benchmark::kMillisecond)->UseRealTime()->Arg(0)->Arg(1);
}

BENCHMARK(build<Aabb>)->Apply(builds);
BENCHMARK(build<Obb>)->Apply(builds);
BENCHMARK(build<BoundingSphere>)->Apply(builds);
BENCHMARK(fcl_build)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(refit<Aabb>)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(refit<Obb>)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(refit<BoundingSphere>)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(all_pairs<Aabb>)->Apply(queries);
BENCHMARK(all_pairs<Obb>)->Apply(queries);
BENCHMARK(all_pairs<BoundingSphere>)->Apply(queries);
BENCHMARK_CAPTURE(fcl_collide, all_pairs, kAll, false)
    ->Unit(benchmark::kMicrosecond)
    ->Arg(kPressed)
    ->Arg(kTouching);
BENCHMARK_CAPTURE(fcl_collide, all_contacts, kAll, true)
    ->Unit(benchmark::kMicrosecond)
    ->Arg(kPressed)
    ->Arg(kTouching);
BENCHMARK(any_pair<Aabb>)->Apply(queries)->Apply(apart);
BENCHMARK(any_pair<Obb>)->Apply(queries)->Apply(apart);
BENCHMARK(any_pair<BoundingSphere>)->Apply(queries)->Apply(apart);
BENCHMARK_CAPTURE(fcl_collide, any_pair, std::size_t{1}, false)
    ->Unit(benchmark::kMicrosecond)
    ->Arg(kPressed)
    ->Arg(kTouching)
    ->Arg(kSeparated);
BENCHMARK(distance<Aabb>)->Apply(apart);
BENCHMARK(distance<Obb>)->Apply(apart);
BENCHMARK(distance<BoundingSphere>)->Apply(apart);
BENCHMARK(warm_distance<Aabb>)->Apply(apart);
BENCHMARK(warm_distance<Obb>)->Apply(apart);
BENCHMARK(fcl_mesh_distance)->Unit(benchmark::kMicrosecond)->Arg(kSeparated);

}  // namespace
}  // namespace offstage::sim
