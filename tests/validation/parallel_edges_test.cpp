/// Contact of almost parallel edges: the point where they cross, and with it the normal, moves along them at
/// any speed and changes from step to step (physics R9, R11).

#include <algorithm>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/world.h"
#include "validation/both_solvers.h"

namespace offstage::sim {
namespace {

class Edges : public BothSolvers {};

// A drum slides over the upper edge of a block, pushed by a ball. The available energy is 18 J, until both
// are a metre below. A wrong rate of the normal gave a drum tilted by a thousandth up to 6e8 J.
TEST_P(Edges, ADrumSlidingOverAnEdgeGainsNoEnergy) {
  const Quat lying(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitX()));
  for (const Real askew : {1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1})
    for (const Real speed : {0.3, 1.0})
      for (const Real step : {1.0 / 240, 1.0 / 500}) {
        World world(def(step));
        world.add_body({.shape = Box{{1, 1, 2}},
                        .motion = MotionType::static_body,
                        .pose = {Vec3(0, -0.5, 0), Quat::Identity()},
                        .restitution = 0,
                        .friction = 0});
        world.add_body(
            {.shape = Cylinder{0.08, 0.2},
             .pose = {Vec3(0.45, 0.08, 0.1), Quat(Eigen::AngleAxisd(askew, Vec3::UnitY())) * lying},
             .velocity = {speed, 0, 0},
             .restitution = 0.1,
             .friction = 0.4});
        world.add_body({.shape = Sphere{0.09},
                        .pose = {Vec3(0.275, 0.09, 0.12), Quat::Identity()},
                        .velocity = {speed, 0, 0},
                        .restitution = 0.3,
                        .friction = 0.6});
        Real least = world.energy().total(), gain = 0;
        for (Real t = 0; t < 1; t += step) {
          world.step(step);
          const Real now = world.energy().total();
          gain = std::max(gain, now - least);
          least = std::min(least, now);
        }
        EXPECT_LT(gain, 0.5) << "askew by " << askew << ", " << speed << " m/s, step " << step;
      }
}

OFFSTAGE_BOTH_SOLVERS(Solvers, Edges);

}  // namespace
}  // namespace offstage::sim
