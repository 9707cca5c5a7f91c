/// Bodies that springs press on the ground or pull along it. The spring's natural oscillation is up to 1.2
/// rad in a sub-step, but nothing moves.

#include <cmath>

#include <gtest/gtest.h>

#include "sim/world.h"
#include "validation/both_solvers.h"

namespace offstage::sim {
namespace {

class SprungContact : public BothSolvers {};

TEST_P(SprungContact, ABodyPressedOnTheGroundStaysOnIt) {
  for (const Real step : {1.0 / 240, 1.0 / 60})
    for (const Real stiffness : {500.0, 2000.0, 5000.0})
      for (const Shape& shape : {Shape{Sphere{0.1}}, Shape{Box{{0.4, 0.2, 0.3}}}}) {
        World world(def(step));
        world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
        const BodyHandle body = world.add_body(
            {.shape = shape, .pose = {Vec3(0, 0.1, 0), Quat::Identity()}, .mass = 1, .restitution = 0});
        world.add_spring({.a = WorldPoint{{0, -3, 0}},
                          .b = BodyPoint{body},
                          .stiffness = stiffness,
                          .damping = 10,
                          .rest_length = 0});
        run(world, 0.5, step);
        EXPECT_NEAR(world.body(body).pose.position.y(), 0.1, 1e-4)
            << stiffness << " N/m, step " << step << ", shape " << shape.index();
      }
}

TEST_P(SprungContact, FrictionHoldsABodyThatASpringPulls) {
  for (const Real step : {1.0 / 240, 1.0 / 60}) {
    World world(def(step));
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .friction = 0.8});
    const BodyHandle body = world.add_body({.shape = Box{{0.4, 0.2, 0.3}},
                                            .pose = {Vec3(0, 0.1, 0), Quat::Identity()},
                                            .mass = 1,
                                            .restitution = 0,
                                            .friction = 0.8});
    // 5 N of the 7.8 N that friction can hold.
    world.add_spring({.a = WorldPoint{{1.001, 0, 0}},
                      .b = BodyPoint{body, {0, -0.1, 0}},
                      .stiffness = 5000,
                      .damping = 0,
                      .rest_length = 1});
    run(world, 1, step);
    EXPECT_NEAR(world.body(body).pose.position.x(), 0, 1e-5) << step;
  }
}

OFFSTAGE_ALL_SOLVERS(Solvers, SprungContact);

}  // namespace
}  // namespace offstage::sim
