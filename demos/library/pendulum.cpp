// Simulates a double pendulum and prints angle, speed and energy as CSV.
//
//   build/pendulum > pendulum.csv

#include <cmath>
#include <cstdio>
#include <exception>
#include <numbers>

#include "sim/world.h"

using namespace offstage;

int main() try {
  // Two rods of 0.5 m and 1 kg, horizontal at first. Each hangs from its left end by a hinge about the Z
  // axis.
  constexpr double kLength = 0.5;
  sim::World world({.max_step = 1.0 / 960});
  sim::BodyHandle upper, lower;
  for (sim::BodyHandle* rod : {&upper, &lower}) {
    const double left = rod == &upper ? 0 : kLength;
    *rod = world.add_body({.shape = sim::Box{{kLength, 0.04, 0.04}},
                           .pose = {.position = {left + kLength / 2, 0, 0}},
                           .mass = 1,
                           .collides = false});
  }
  const auto shoulder = world.add_joint({.type = sim::JointType::revolute, .a = upper, .anchor = {0, 0, 0}});
  const auto elbow =
      world.add_joint({.type = sim::JointType::revolute, .a = lower, .b = upper, .anchor = {kLength, 0, 0}});

  const double start = world.energy().total();
  std::puts("time_s,shoulder_deg,elbow_deg,elbow_rad_per_s,energy_J");
  for (int frame = 0; frame <= 120; ++frame) {
    const sim::JointState s = world.joint(shoulder), e = world.joint(elbow);
    constexpr double kDegrees = 180 / std::numbers::pi;
    std::printf("%.4f,%.3f,%.3f,%.4f,%.9f\n", world.time(), s.coordinate * kDegrees, e.coordinate * kDegrees,
                e.speed, world.energy().total());
    world.step(1.0 / 60);
  }
  // There is no dissipation, so the drift is the error of the integrator.
  const double drift = std::abs(world.energy().total() - start);
  std::fprintf(stderr, "energy drift in 2 s: %.1e J\n", drift);
  return drift < 1e-6 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "pendulum: %s\n", error.what());
  return 1;
}
