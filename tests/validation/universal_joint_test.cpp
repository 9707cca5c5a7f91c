/// A universal joint whose two axes and the lever arm of a light link become coplanar (physics A1, A6). In
/// that singular pose, the joint's constraint on its axes does not determine the rotation of the link about
/// its arm; near it, the link flips at any speed.

#include <algorithm>

#include <gtest/gtest.h>

#include "sim/world.h"

namespace offstage::sim {
namespace {

/// Total energy of the pair, and its angular momentum about the origin.
struct PairState {
  Real energy;
  Vec3 angular_momentum = Vec3::Zero();

  explicit PairState(const World& world) : energy(world.energy().total()) {
    world.for_each_body([&](BodyHandle handle) {
      const BodyState s = world.body(handle);
      angular_momentum += s.centre.cross(s.mass * s.velocity) + s.angular_momentum;
    });
  }
};

/// Returns a heavy capsule and a ball with little inertia, each half a metre from the joint between them.
World heavy_and_light(Real max_step) {
  World world({.gravity = Vec3::Zero(), .max_step = max_step, .sleep = false});
  BodyDef heavy;
  heavy.shape = Capsule{0.09, 0.17};
  heavy.mass = 7.5;
  heavy.pose.position = {-0.5, 0, 0};
  heavy.angular_velocity = {3, 5, -4};
  BodyDef light;
  light.shape = Sphere{0.0036};
  light.mass = 1.4;
  light.pose.position = {0.5, 0, 0};
  light.velocity = {0, 1, -4};
  JointDef joint;
  joint.type = JointType::universal;
  joint.axis = Vec3(0.2, 0.1, 1).normalized();
  joint.second_axis = joint.axis.cross(Vec3(0.3, 1, 0.2)).normalized();
  joint.a = world.add_body(heavy);
  joint.b = world.add_body(light);
  world.add_joint(joint);
  return world;
}

// Without halved sub-steps, the energy triples at 1/240 s. The remaining error is that of the integrator.
TEST(UniversalJointPose, InOnePlaneKeepsEnergyAndAngularMomentum) {
  for (const Real step : {1.0 / 480, 1.0 / 240, 1.0 / 120, 1.0 / 60}) {
    SCOPED_TRACE(step);
    World world = heavy_and_light(step);
    world.step(1.0 / 60);  // the first step makes the velocities consistent with the joint
    const PairState start(world);
    Real most = start.energy, least = start.energy;
    while (world.time() < 10) {
      const StepReport report = world.step(1.0 / 60);
      EXPECT_EQ(report.joints.unsolved, 0u);
      most = std::max(most, world.energy().total());
      least = std::min(least, world.energy().total());
    }
    EXPECT_LT(most, start.energy * (1 + 1e-3));
    EXPECT_GT(least, start.energy * (1 - 1e-2));
    EXPECT_LT((PairState(world).angular_momentum - start.angular_momentum).norm(),
              1e-5 * start.angular_momentum.norm());
  }
}

}  // namespace
}  // namespace offstage::sim
