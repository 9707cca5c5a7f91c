/// A square of cotton of 4 m dropped on a sphere of radius 1 on the ground, 72 frames at 24 per second: CPU
/// time per frame, and how well it did: strain, depth in bodies, crossings of cloth. bench_cloth [CELLS
/// SELF_COLLISION [SUBSTEPS_PER_SECOND]]; without arguments the usual cases.

#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "effects/cloth.h"
#include "sim/world.h"
#include "tests/cloth_crossings.h"

namespace {

using namespace offstage;
using namespace offstage::sim;

double cpu_seconds() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

void run(uint32_t cells, bool self_collision, Real rate) {
  effects::Fabric fabric = effects::find_fabric("cotton")->fabric;
  fabric.thickness = 0.012;
  ClothDef def = effects::grid_cloth({4, 4, cells, cells}, {Vec3(0.15, 2.35, 0)}, fabric);
  def.self_collision = self_collision;
  if (rate > 0) def.substep = 1 / rate;
  World world;
  world.add_body({.shape = Plane{}, .motion = MotionType::fixed});
  world.add_body({.shape = Sphere{1}, .motion = MotionType::fixed, .pose = {{0, 1, 0}}});
  const ClothHandle cloth = world.add_cloth(def);
  constexpr int kFrames = 72;
  double total = 0, worst = 0;
  Real strain = 0, mean = 0, depth = 0;
  std::size_t crossed = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    const double before = cpu_seconds();
    const StepReport report = world.step(1.0 / 24);
    const double spent = cpu_seconds() - before;
    total += spent;
    worst = std::max(worst, spent);
    strain = std::max(strain, report.cloth_strain);
    mean += world.cloth_report(cloth).mean_strain / kFrames;
    depth = std::max(depth, report.cloth_penetration);
    if (self_collision) crossed = std::max(crossed, crossings(world.cloth(cloth)));
  }
  std::printf(
      "%4u x %-4u self %d: %7.1f CPU ms a frame, worst %7.1f; strain mean %.4f greatest %.4f; in bodies %.2g "
      "m; "
      "crossings %zu\n",
      cells, cells, self_collision, 1e3 * total / kFrames, 1e3 * worst, mean, strain, depth, crossed);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc >= 3) {
    run(static_cast<uint32_t>(std::atoi(argv[1])), std::atoi(argv[2]) != 0,
        argc > 3 ? std::atof(argv[3]) : 0);
    return 0;
  }
  for (uint32_t cells : {60u, 100u, 200u})
    for (bool self : {false, true}) run(cells, self, 0);
}
