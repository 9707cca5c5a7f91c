/// Bodies in contact move by the same bits for any number of threads and in every repeat.

#include <vector>

#include <oneapi/tbb/global_control.h>

#include "tests/random.h"
#include "tests/validation/both_solvers.h"

namespace offstage::sim {
namespace {

class BodyDeterminism : public testing::TestWithParam<SolverKind> {
 protected:
  /// Several heaps of all shapes, some of which bounce, with a ball that rolls in.
  static StateHash heaps(int per_heap, Real restitution) {
    World world({.solver = GetParam()});
    world.add_body({.shape = Plane{}, .motion = MotionType::fixed, .restitution = 0});
    const Scatter random{5};
    for (int heap = 0; heap < 4; ++heap)
      for (int i = 0; i < per_heap; ++i) {
        const auto u = [&](uint64_t k) { return 2 * random.uniform(uint64_t(heap * 100 + i), k) - 1; };
        const Shape shapes[] = {Box{{0.2, 0.15, 0.2}}, Sphere{0.1}, Capsule{0.08, 0.1}, Cylinder{0.1, 0.15}};
        world.add_body({.shape = shapes[i % 4],
                        .pose = {Vec3(2.0 * heap + 0.12 * u(0), 0.25 + 0.3 * i, 0.12 * u(1)),
                                 Quat(u(2), u(3), u(4), u(5)).normalized()},
                        .restitution = i % 2 == 0 ? restitution : 0});
      }
    world.add_body({.shape = Sphere{0.2}, .pose = {Vec3(-1, 0.21, 0)}, .velocity = {5, 0, 0}});
    uint64_t tracebacks = 0;
    for (int i = 0; i < 60; ++i) tracebacks += world.step(1.0 / 60).tracebacks;
    if (restitution > 0) {
      EXPECT_GT(tracebacks, 0u);
    }
    return world.state_hash();
  }
};

TEST_P(BodyDeterminism, SameHashForAnyNumberOfThreadsAndEveryRepeat) {
  for (const Real restitution : {0.0, 0.6}) {
    const StateHash expected = heaps(5, restitution);
    for (const std::size_t threads : {1, 2, 4}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      EXPECT_EQ(heaps(5, restitution), expected) << threads << " threads, restitution " << restitution;
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Solvers, BodyDeterminism,
                         testing::Values(SolverKind::exact, SolverKind::fast, SolverKind::automatic),
                         [](const auto& p) {
                           return std::string(p.param == SolverKind::exact  ? "exact"
                                              : p.param == SolverKind::fast ? "fast"
                                                                            : "automatic");
                         });

}  // namespace
}  // namespace offstage::sim
