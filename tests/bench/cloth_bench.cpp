/// Measures a square of cotton with edges of 4 m that falls on a sphere of radius 1 m on the ground, for 72
/// frames at 24 per second: CPU time per frame, and the errors: strain, depth in bodies, crossings of cloth.
/// bench_cloth [CELLS SELF_COLLISION [SUBSTEPS_PER_SECOND]] or peer NODES [SUBSTEPS_PER_SECOND]; without
/// arguments, runs the default cases.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

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
  fabric.thickness = std::min(0.012, 0.3 * 4.0 / cells);
  ClothDef def = effects::grid_cloth({4, 4, cells, cells}, {Vec3(0.15, 2.35, 0)}, fabric);
  def.self_collision = self_collision;
  if (rate > 0) def.substep = 1 / rate;
  World world;
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  world.add_body({.shape = Sphere{1}, .motion = MotionType::static_body, .pose = {{0, 1, 0}}});
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
    strain = std::max(strain, report.cloth.strain);
    mean += world.cloth_report(cloth).mean_strain / kFrames;
    depth = std::max(depth, report.cloth.penetration);
    if (self_collision) crossed = std::max(crossed, crossings(world.cloth(cloth)));
  }
  std::printf(
      "%4u x %-4u self %d: %7.1f CPU ms a frame, worst %7.1f; strain mean %.4f greatest %.4f; in bodies %.2g "
      "m; "
      "crossings %zu\n",
      cells, cells, self_collision, 1e3 * total / kFrames, 1e3 * worst, mean, strain, depth, crossed);
}

/// Runs the scene `cloth N` of the benchmarks against other engines (PEERS.md): N x N nodes with a total mass
/// of 1 kg hang by two corners over a sphere. It takes 4 s in steps of 1/240 s, without air and
/// self-collision.
void run_peer(uint32_t nodes, Real rate) {
  effects::Fabric fabric = effects::find_fabric("cotton")->fabric;
  fabric.areal_density = 0.25;
  fabric.thickness = 0.02;
  fabric.friction = 0.5;
  const uint32_t cells = nodes - 1;
  ClothDef def = effects::grid_cloth({2, 2, cells, cells}, {Vec3(0, 2, 0)}, fabric);
  def.air.density = 0;
  def.self_collision = false;
  if (rate > 0) def.substep = 1 / rate;
  for (uint32_t corner : {0u, cells})
    def.pins.push_back({.vertex = corner, .position = def.vertices[corner]});
  World world;
  world.add_body(
      {.shape = Sphere{0.4}, .motion = MotionType::static_body, .pose = {{0, 1.2, 0}}, .friction = 0.5});
  const ClothHandle cloth = world.add_cloth(def);
  constexpr int kSteps = 960;
  const double before = cpu_seconds();
  Real greatest = 0, depth = 0;
  for (int i = 0; i < kSteps; ++i) {
    const StepReport report = world.step(1.0 / 240);
    greatest = std::max(greatest, report.cloth.strain);
    depth = std::max(depth, report.cloth.penetration);
  }
  const ClothReport& end = world.cloth_report(cloth);
  std::printf(
      "cloth %u: %.3f CPU ms a step; at the end strain mean %.5f greatest %.4f (ever %.4f); in bodies %.2g "
      "m\n",
      nodes, 1e3 * (cpu_seconds() - before) / kSteps, end.mean_strain, end.max_strain, greatest, depth);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc >= 3 && std::string(argv[1]) == "peer") {
    run_peer(static_cast<uint32_t>(std::atoi(argv[2])), argc > 3 ? std::atof(argv[3]) : 0);
    return 0;
  }
  if (argc >= 3) {
    run(static_cast<uint32_t>(std::atoi(argv[1])), std::atoi(argv[2]) != 0,
        argc > 3 ? std::atof(argv[3]) : 0);
    return 0;
  }
  for (uint32_t cells : {60u, 100u, 200u})
    for (bool self : {false, true}) run(cells, self, 0);
}
