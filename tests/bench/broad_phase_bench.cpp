/// Measures the broad phase of spheres with diameters from 1 cm to 1 m, equally many in each octave: from the
/// new boxes to all overlapping pairs. The time to compute the boxes is excluded, both for the grids and for
/// FCL.

#include <cmath>
#include <memory>

#include <benchmark/benchmark.h>
#include <fcl/broadphase/broadphase_SSaP.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree_array.h>
#include <fcl/broadphase/broadphase_interval_tree.h>
#include <fcl/broadphase/broadphase_spatialhash.h>
#include <fcl/geometry/shape/sphere.h>

#include "sim/collision/broad_phase.h"
#include "tests/random.h"

namespace offstage::sim {
namespace {

constexpr uint32_t kSpheres = 100'000;

/// The spheres and their motion: back and forth by up to 1.5 cm per step.
class Crowd {
 public:
  /// `partners`: mean number of boxes that a box overlaps.
  explicit Crowd(Real partners) {
    // Cubes with the sides s and t overlap if their distance vector is in a cube of the volume (s + t)^3.
    // This is the mean of the volume over all sizes.
    constexpr Real kMeanVolume = 0.285;
    side_ = std::cbrt(kSpheres * kMeanVolume / partners);
  }
  Real diameter(uint32_t i) const { return 0.01 * std::pow(100, random_.uniform(i, 3)); }
  Real side() const { return side_; }
  Vec3 centre(uint32_t i, int step) const {
    const int phase = step % 40;
    const Real way = 0.03 * (phase < 20 ? phase : 40 - phase);
    Vec3 p;
    for (uint32_t k = 0; k < 3; ++k)
      p[k] = side_ * random_.uniform(i, k) + way * (random_.uniform(i, 4 + k) - 0.5);
    return p;
  }
  Aabb box(uint32_t i, int step) const {
    const Vec3 p = centre(i, step), r = Vec3::Constant(diameter(i) / 2);
    return {p - r, p + r};
  }
  /// Returns the spheres that move in a step: one in `every`.
  static std::vector<uint32_t> movers(int step, uint32_t every) {
    std::vector<uint32_t> movers;
    for (uint32_t i = static_cast<uint32_t>(step) % every; i < kSpheres; i += every) movers.push_back(i);
    return movers;
  }

 private:
  Scatter random_{1};
  Real side_;
};

void count_pairs(benchmark::State& state, std::size_t pairs) {
  state.counters["pairs"] =
      benchmark::Counter(static_cast<double>(pairs), benchmark::Counter::kAvgIterations);
}

/// Arguments: mean number of partners, in hundredths; n, if one in n spheres moves.
void grid(benchmark::State& state, GridKind kind) {
  const Crowd crowd(static_cast<Real>(state.range(0)) / 100);
  BroadPhase broad_phase(kind);
  for (uint32_t i = 0; i < kSpheres; ++i) broad_phase.insert(i, crowd.box(i, 0));
  broad_phase.pairs();
  std::size_t pairs = 0;
  int step = 0;
  std::vector<Aabb> boxes;
  for (auto _ : state) {
    state.PauseTiming();
    const auto movers = Crowd::movers(++step, static_cast<uint32_t>(state.range(1)));
    boxes.clear();
    for (const uint32_t i : movers) boxes.push_back(crowd.box(i, step));
    state.ResumeTiming();
    for (std::size_t k = 0; k < movers.size(); ++k) broad_phase.move(movers[k], boxes[k]);
    pairs += broad_phase.pairs().size();
  }
  count_pairs(state, pairs);
}

void fcl_manager(benchmark::State& state, fcl::BroadPhaseCollisionManagerd& manager) {
  const Crowd crowd(static_cast<Real>(state.range(0)) / 100);
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> spheres;
  std::vector<fcl::CollisionObjectd*> all;
  for (uint32_t i = 0; i < kSpheres; ++i) {
    spheres.push_back(
        std::make_unique<fcl::CollisionObjectd>(std::make_shared<fcl::Sphered>(crowd.diameter(i) / 2)));
    spheres.back()->setTranslation(crowd.centre(i, 0));
    spheres.back()->computeAABB();
    all.push_back(spheres.back().get());
  }
  manager.registerObjects(all);
  manager.setup();
  const auto count = [](fcl::CollisionObjectd*, fcl::CollisionObjectd*, void* pairs) {
    ++*static_cast<std::size_t*>(pairs);
    return false;
  };
  std::size_t pairs = 0;
  int step = 0;
  for (auto _ : state) {
    state.PauseTiming();
    std::vector<fcl::CollisionObjectd*> moved;
    for (const uint32_t i : Crowd::movers(++step, static_cast<uint32_t>(state.range(1)))) {
      all[i]->setTranslation(crowd.centre(i, step));
      all[i]->computeAABB();
      moved.push_back(all[i]);
    }
    state.ResumeTiming();
    if (moved.size() == all.size())
      manager.update();
    else
      manager.update(moved);
    manager.collide(&pairs, count);
  }
  count_pairs(state, pairs);
}

template <class Manager>
void fcl_manager(benchmark::State& state) {
  Manager manager;
  fcl_manager(state, manager);
}

void fcl_spatial_hash(benchmark::State& state) {
  constexpr Real kCell = 0.5;
  const Real side = Crowd(static_cast<Real>(state.range(0)) / 100).side();
  fcl::SpatialHashingCollisionManagerd<> manager(kCell, Vec3::Constant(-1), Vec3::Constant(side + 1),
                                                 kSpheres);
  fcl_manager(state, manager);
}

void cases(benchmark::internal::Benchmark* b) {
  b->ArgNames({"partners_100", "one_in"})->Args({500, 1})->Args({10, 1})->Args({500, 4})->Args({500, 100});
  b->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
}
void slow_case(benchmark::internal::Benchmark* b) {
  b->ArgNames({"partners_100", "one_in"})->Args({500, 1})->Iterations(2);
  b->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
}

BENCHMARK_CAPTURE(grid, multilevel, GridKind::multilevel)->Apply(cases);
BENCHMARK_CAPTURE(grid, uniform, GridKind::uniform)->Apply(cases);
BENCHMARK(fcl_manager<fcl::DynamicAABBTreeCollisionManagerd>)->Apply(cases);
BENCHMARK(fcl_manager<fcl::DynamicAABBTreeCollisionManager_Arrayd>)->Apply(cases);
BENCHMARK(fcl_manager<fcl::SSaPCollisionManagerd>)->Apply(slow_case);
BENCHMARK(fcl_manager<fcl::IntervalTreeCollisionManagerd>)->Apply(slow_case);
BENCHMARK(fcl_spatial_hash)->Apply(slow_case);

}  // namespace
}  // namespace offstage::sim
