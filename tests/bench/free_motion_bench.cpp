/// Measures the free motion of single bodies: by the closed form, and by the integrators where there is no
/// closed form.

#include <benchmark/benchmark.h>
#include <oneapi/tbb/global_control.h>

#include "sim/world/coupled_system.h"

namespace offstage::sim {
namespace {

void fill(WorldState& world, int64_t count, const Vec3& moments, Real drag) {
  for (int64_t i = 0; i < count; ++i) {
    auto body = std::make_unique<Body>();
    RigidBody& r = body->rigid;
    r.inertia = moments.asDiagonal();
    r.inverse_inertia = r.inertia.inverse();
    r.linear_drag = drag;
    r.position = {static_cast<Real>(i), 0, 0};
    r.set_velocity({1, 2, 3}, {3, 1, static_cast<Real>(i % 7)});
    world.bodies.insert(std::move(body));
  }
}

void run_free_motion(benchmark::State& state, const Vec3& moments, Real drag, IntegratorKind kind) {
  const oneapi::tbb::global_control one(oneapi::tbb::global_control::max_allowed_parallelism, 1);
  WorldState world;
  fill(world, state.range(0), moments, drag);
  for (auto _ : state) CoupledSystem(world).step(integrator(kind), 0, 1.0 / 240);
  state.SetItemsProcessed(state.iterations() * state.range(0));
}

void cubes(benchmark::State& state) {
  run_free_motion(state, Vec3::Ones(), 0, IntegratorKind::rk4);
}
void bricks_rk4(benchmark::State& state) {
  run_free_motion(state, {1, 2, 3}, 0, IntegratorKind::rk4);
}
void dragged_rk4(benchmark::State& state) {
  run_free_motion(state, Vec3::Ones(), 0.1, IntegratorKind::rk4);
}
void dragged_dormand_prince(benchmark::State& state) {
  run_free_motion(state, Vec3::Ones(), 0.1, IntegratorKind::dormand_prince);
}
BENCHMARK(cubes)->Arg(100)->Arg(1000)->Arg(10000);
BENCHMARK(bricks_rk4)->Arg(1000);
BENCHMARK(dragged_rk4)->Arg(1000);
BENCHMARK(dragged_dormand_prince)->Arg(1000);

}  // namespace
}  // namespace offstage::sim
