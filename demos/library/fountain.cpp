// Releases particles from a disc, lets them collide with the ground, and prints counts once per second.
//
//   build/fountain

#include <algorithm>
#include <cstdio>
#include <exception>

#include "effects/emitter.h"
#include "sim/world.h"

using namespace offstage;

int main() try {
  sim::World world;
  world.add_body({.name = "ground", .shape = sim::Plane{}, .motion = sim::MotionType::static_body});

  // The world owns the particles; the emitter decides when, where and how fast each one starts.
  const auto drops = world.add_particle_system({.name = "drops"});
  effects::Emitter nozzle(
      {.name = "nozzle",
       .seed = 7,
       .surface = {.kind = effects::SurfaceKind::disc, .pose = {.position = {0, 0.3, 0}}, .radius = 0.05},
       .release = {.rate = 2000.0},                                          // [1/s]
       .particles = {.speed = effects::Normal{.mean = 6, .deviation = 0.3},  // [m/s]
                     .spread_deg = 8.0,
                     .radius = 0.004,
                     .lifespan = 2.5}},
      drops);
  for (int second = 1; second <= 4; ++second) {
    sim::StepReport report;
    uint64_t collisions = 0;
    for (int frame = 0; frame < 30; ++frame) {
      // Emitters run before each sub-step, so that every particle is created at its own time within the step.
      report = world.step(1.0 / 30, [&](double start, double end) { nozzle.emit(world, start, end); });
      collisions += report.particles.collisions;
    }
    double top = 0;
    for (const auto& position : world.particles(drops).position) top = std::max(top, position.y());
    std::printf("%d s: released %llu, alive %zu, collisions %llu, highest %.3f m\n", second,
                static_cast<unsigned long long>(nozzle.report().released), world.particle_count(),
                static_cast<unsigned long long>(collisions), top);
    if (!report.finite) return 1;
  }
  // The same on all machines of a fingerprint class.
  std::printf("state %s\n", world.state_hash().hex().c_str());
} catch (const std::exception& error) {
  std::fprintf(stderr, "fountain: %s\n", error.what());
  return 1;
}
