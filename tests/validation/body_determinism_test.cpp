/// Bodies in contact move identically, bit for bit, for any number of threads and in every repetition.

#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <oneapi/tbb/global_control.h>

#include "tests/meshes.h"
#include "tests/random.h"
#include "tests/solids.h"
#include "tests/validation/both_solvers.h"

namespace offstage::sim {
namespace {

class BodyDeterminism : public testing::TestWithParam<SolverKind> {
 protected:
  /// Simulates several heaps of all shapes, some of which bounce, and a ball that rolls into them. Returns
  /// the state hash.
  static StateHash heaps(int per_heap, Real restitution) {
    World world({.solver = GetParam()});
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0});
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
    for (int i = 0; i < 60; ++i) tracebacks += world.step(1.0 / 60).impacts.tracebacks;
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

class CrowdDeterminism : public BodyDeterminism {
 protected:
  struct Outcome {
    StateHash hash;
    std::size_t touching = 0;  ///< greatest number of pairs at once
  };

  /// Simulates a heap that is pushed together, and columns that fall beside it. Some bodies of each bounce.
  /// The world uses threads for 200 awake bodies, the fast solver for 384 touching pairs (48 batches of
  /// eight), and the exact solver for islands, which it solves in parallel: it gets a smaller heap and more
  /// columns.
  static Outcome crowd() {
    const bool is_exact = GetParam() == SolverKind::exact;
    const int side = is_exact ? 3 : 6, high = is_exact ? 4 : 7;  // size of the heap
    World world({.max_step = 1.0 / 120, .solver = GetParam(), .collision_speed = 0.4});
    const MeshHandle angle = world.add_mesh(placed_at_random(l_solid(), 0.09, 3));
    const MeshHandle crystal = world.add_mesh(sphere_mesh(0.1, 6, 4));
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0});
    const Scatter random{11};
    uint64_t number = 0;
    const auto add = [&](const Vec3& at, const Vec3& velocity, bool bounces) {
      const uint64_t i = number++;
      const auto u = [&](uint64_t k) { return 2 * random.uniform(i, k) - 1; };
      const Shape shapes[] = {Box{{0.2, 0.18, 0.2}}, Sphere{0.1},        Box{{0.18, 0.2, 0.19}},
                              Capsule{0.07, 0.08},   MeshShape{crystal}, Box{{0.2, 0.2, 0.16}}};
      const Shape& shape = i % 23 == 22 ? Shape(MeshShape{angle}) : shapes[i % 6];
      world.add_body({.shape = shape,
                      .pose = {at, Quat(1, 0.1 * u(0), 0.1 * u(1), 0.1 * u(2)).normalized()},
                      .velocity = velocity + 0.3 * Vec3(u(3), u(4), u(5)),
                      .restitution = bounces ? 0.3 : 0});
    };
    for (int y = 0; y < high; ++y)
      for (int x = 0; x < side; ++x)
        for (int z = 0; z < side; ++z) {
          const Vec3 at(0.22 * (x - 0.5 * (side - 1)), 0.12 + 0.21 * y, 0.22 * (z - 0.5 * (side - 1)));
          add(at, Vec3(-3 * at.x(), -1.5, -3 * at.z()), number % 72 == 20);
        }
    for (int column = 0; column < (is_exact ? 60 : 40); ++column)
      for (int y = 0; y < 3; ++y)
        add({1.5 + 0.5 * (column % 6), 0.13 + 0.22 * y, 0.5 * (column / 6)}, {0, -0.5, 0}, column % 8 == 0);
    Outcome outcome;
    Tally tally;
    uint32_t most_islands = 0;
    for (int i = 0; i < (is_exact ? 6 : 10); ++i) {
      tally.add(world.step(1.0 / 60));
      EXPECT_GE(tally.last.bodies.awake, 200u);
      most_islands = std::max(most_islands, tally.last.bodies.islands);
      std::set<std::pair<uint32_t, uint32_t>> pairs;
      for (const ContactState& c : world.contacts()) pairs.emplace(c.a.index, c.b.index);
      outcome.touching = std::max(outcome.touching, pairs.size());
    }
    EXPECT_GT(most_islands, 30u);
    EXPECT_GT(tally.tracebacks, 0u);
    EXPECT_GT(tally.collisions, 50u);
    outcome.hash = world.state_hash();
    return outcome;
  }
};

TEST_P(CrowdDeterminism, SameHashWhereThreadsAreUsed) {
  std::optional<StateHash> expected;
  for (const std::size_t threads : {1, 2, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    for (int repeat = 0; repeat < 2; ++repeat) {
      const Outcome outcome = crowd();
      if (GetParam() != SolverKind::exact) {
        EXPECT_GT(outcome.touching, 384u);
      }
      if (!expected) expected = outcome.hash;
      EXPECT_EQ(outcome.hash, *expected) << threads << " threads";
    }
  }
}

std::string any_solver_name(const testing::TestParamInfo<SolverKind>& info) {
  return info.param == SolverKind::automatic ? "automatic" : solver_name(info);
}
const auto kAnySolver = testing::Values(SolverKind::exact, SolverKind::fast, SolverKind::automatic);
INSTANTIATE_TEST_SUITE_P(Solvers, BodyDeterminism, kAnySolver, any_solver_name);
INSTANTIATE_TEST_SUITE_P(Solvers, CrowdDeterminism, kAnySolver, any_solver_name);

}  // namespace
}  // namespace offstage::sim
