#include "sim/dynamics/force_field.h"

#include <cmath>

#include <gtest/gtest.h>

#include "sim/collision/distance.h"
#include "sim/dynamics/free_body.h"

namespace offstage::sim {
namespace {

RigidMotion at_rest(const Vec3& position) {
  return {position, Quat::Identity(), Vec3::Zero(), Vec3::Zero()};
}

TEST(Region, StrengthFallsToZeroAtTheEdgeByTheDropRate) {
  const Region sphere = SphereRegion{{1, 0, 0}, 2};
  EXPECT_EQ(strength(sphere, 1, {1, 0, 0}), 1);
  EXPECT_NEAR(strength(sphere, 1, {1, 0.5, 0}), 0.75, 1e-15);
  EXPECT_NEAR(strength(sphere, 3, {1, 0.5, 0}), 0.75 * 0.75 * 0.75, 1e-15);
  EXPECT_EQ(strength(sphere, 0, {2.9, 0, 0}), 1);
  EXPECT_EQ(strength(sphere, 0, {3.1, 0, 0}), 0);
  EXPECT_EQ(strength(sphere, 2, {3, 0, 0}), 0);
  // The axis whose edge is nearest decides: 1 - 0.8 in y, although the distance along x is larger.
  const Region box = BoxRegion{{0, 1, 0}, {10, 1, 10}};
  EXPECT_NEAR(strength(box, 1, {2, 1.4, 0}), 0.2, 1e-15);
  EXPECT_NEAR(strength(box, 2, {2, 1.4, 0}), 0.04, 1e-15);
  EXPECT_EQ(strength(box, 0, {2, 1.6, 0}), 0);
  EXPECT_EQ(strength(Everywhere{}, 5, {1e6, 0, 0}), 1);
}

TEST(Fields, PullTowardsTheirPointWhileTheyAreOn) {
  ForceDef field{.start = 1, .end = 2, .effect = PointField{{0, 3, 0}, 8, SphereRegion{{0, 3, 0}, 4}, 1}};
  EXPECT_EQ(wrench(field, 0.5, at_rest({0, 1, 0}), Vec3::Zero()).force, Vec3::Zero());
  EXPECT_EQ(wrench(field, 1, at_rest({0, 1, 0}), Vec3::Zero()).force, Vec3(0, 4, 0));
  EXPECT_EQ(wrench(field, 1, at_rest({0, 5, 0}), Vec3::Zero()).force, Vec3(0, -4, 0));
  EXPECT_EQ(wrench(field, 1, at_rest({0, 3, 0}), Vec3::Zero()).force, Vec3::Zero());
  EXPECT_EQ(wrench(field, 2, at_rest({0, 1, 0}), Vec3::Zero()).force, Vec3::Zero());
}

// Equation of motion: v' = -(k/m)(v - wind).
TEST(Wind, AcceleratesABodyToItsSpeed) {
  const ForceDef wind{.effect = WindField{.wind = {5, 0, 1}, .drag = 3}};
  const std::vector<ActiveForce> active = {{&wind, {}}};
  const BodyForces forces{Vec3::Zero(), active};
  RigidBody body;
  body.mass = 2;
  IntegratorWorkspace work;
  for (int i = 0; i < 240; ++i)
    fly(body, forces, integrator(IntegratorKind::rk4), i / 240.0, 1.0 / 240, work);
  EXPECT_NEAR((body.velocity() - (1 - std::exp(-1.5)) * Vec3(5, 0, 1)).norm(), 0, 1e-9);
}

// The air velocity is the one that particles feel. If the field has no drag, the body's drag
// coefficient applies.
TEST(Air, MovesBodiesByItsOwnDragOrTheirs) {
  const Turbulence turbulence{.speed = 3, .drag = 0.5, .region = SphereRegion{{0, 0, 0}, 4}, .drop_rate = 1};
  const Vortex vortex{.circulation = 7, .radius = 0.5};
  RigidMotion motion = at_rest({0, 1, 0.5});
  motion.velocity = {1, 2, 3};
  const Vec3 air = TurbulentFlow(turbulence, 0.2).velocity(motion.position);
  const Real fraction = 1 - motion.position.norm() / 4;
  const Vec3 by_field = wrench({.effect = turbulence}, 0.2, motion, Vec3::Zero(), 0.3).force;
  EXPECT_NEAR((by_field - fraction * 0.5 * (air - motion.velocity)).norm(), 0, 1e-15);
  const Vec3 by_own = wrench({.effect = vortex}, 0.2, motion, Vec3::Zero(), 0.3).force;
  EXPECT_NEAR((by_own - 0.3 * velocity(vortex, motion.position)).norm(), 0, 1e-15);
}

// At equilibrium, the grabbed point hangs below the hand by weight / stiffness, and the body hangs below that
// point.
TEST(Grab, HoldsABodyByItsPoint) {
  const ForceDef grab{.effect = Grab{.point = {0.5, 0, 0},
                                     .track = {.keys = {{.time = 0, .pose = {Vec3(0, 2, 0)}},
                                                        {.time = 1, .pose = {Vec3(3, 4, 0)}}}},
                                     .stiffness = 200,
                                     .damping = 20}};
  const std::vector<ActiveForce> active = {{&grab, {}}};
  const BodyForces forces{{0, -9.81, 0}, active};
  RigidBody body;
  body.inertia = Vec3(0.1, 0.2, 0.3).asDiagonal();
  body.inverse_inertia = body.inertia.inverse();
  body.angular_drag = 0.3;
  body.position = {0, 2, 0};
  IntegratorWorkspace work;
  for (int i = 0; i < 240 * 60; ++i)
    fly(body, forces, integrator(IntegratorKind::rk4), i / 240.0, 1.0 / 240, work);
  EXPECT_NEAR((body.position - Vec3(3, 4 - 9.81 / 200 - 0.5, 0)).norm(), 0, 1e-6);
  EXPECT_NEAR((body.orientation * Vec3(1, 0, 0) - Vec3(0, 1, 0)).norm(), 0, 1e-6);
}

TEST(ActiveForce, ActsOnTheNamedBodiesOnly) {
  RigidBody a, b;
  const ForceDef all{}, named{.bodies = {BodyHandle{1, 1}}};
  EXPECT_TRUE((ActiveForce{&all, {}}.acts_on(a)));
  EXPECT_TRUE((ActiveForce{&named, {&a}}.acts_on(a)));
  EXPECT_FALSE((ActiveForce{&named, {&a}}.acts_on(b)));
  EXPECT_FALSE((ActiveForce{&named, {}}.acts_on(a)));  // the named body has been removed
}

// An explosion below the middle of a face does not turn the box. Beside the middle it does. It never turns a
// ball.
TEST(Explosion, PushesAwayFromItsPointAndSpinsTheExposedSide) {
  const Shape box = Box{{2, 1, 1}}, ball = Sphere{0.5};
  const Pose pose{Vec3(0, 3, 0)};
  Explosion bang{.point = {0, 2, 0}, .impulse = 10, .radius = 2};
  Wrench w = impulse(bang, {&box}, pose, pose.position);
  EXPECT_NEAR((w.force - Vec3(0, 10 * (1 - 0.5 / 2), 0)).norm(), 0, 1e-12);
  EXPECT_NEAR(w.torque.norm(), 0, 1e-12);
  bang.point.x() = 0.8;  // pushes the +x end up: spin about +z
  w = impulse(bang, {&box}, pose, pose.position);
  EXPECT_NEAR((w.torque - Vec3(0, 0, 0.8 * 7.5)).norm(), 0, 1e-12);
  bang.point = {3, 3, 4};
  bang.radius = 20;
  w = impulse(bang, {&ball}, pose, pose.position);
  EXPECT_NEAR((w.force - 10 * (1 - 4.5 / 20) * Vec3(-0.6, 0, -0.8)).norm(), 0, 1e-12);
  EXPECT_NEAR(w.torque.norm(), 0, 1e-12);
  bang.radius = 4.5;
  EXPECT_NEAR(impulse(bang, {&ball}, pose, pose.position).force.norm(), 0, 1e-12);
  bang.point = {0.1, 3, 0};  // inside the body
  EXPECT_NEAR((impulse(bang, {&ball}, pose, pose.position).force - Vec3(-10, 0, 0)).norm(), 0, 1e-12);
}

TEST(Explosion, GoesOffOnce) {
  const ForceDef bang{.start = 0.5, .effect = Explosion{}};
  EXPECT_FALSE(bang.explodes(0.25, 0.5));
  EXPECT_TRUE(bang.explodes(0.5, 0.75));
  EXPECT_FALSE(bang.explodes(0.75, 1));
}

TEST(ForceDef, NamesErrors) {
  EXPECT_EQ(problem(ForceDef{}), "");
  EXPECT_NE(problem({.start = 2, .end = 1}).find("end"), std::string::npos);
  EXPECT_NE(problem({.effect = WindField{.drag = -1}}).find("drag"), std::string::npos);
  EXPECT_NE(problem({.effect = PointField{.region = SphereRegion{.radius = 0}}}).find("region.radius"),
            std::string::npos);
  EXPECT_NE(problem({.effect = Grab{}}).find("bodies"), std::string::npos);
  EXPECT_NE(problem({.bodies = {BodyHandle{0, 1}}, .effect = Grab{}}).find("keys"), std::string::npos);
  EXPECT_NE(problem({.effect = Explosion{.radius = std::nan("")}}).find("radius"), std::string::npos);
  EXPECT_NE(problem({.effect = LennardJones{}}).find("systems"), std::string::npos);
  const std::vector<ParticleSystemHandle> systems = {{0, 1}};
  EXPECT_EQ(problem({.systems = systems, .effect = Coulomb{}}), "");
  EXPECT_NE(problem({.systems = systems, .effect = LennardJones{.sigma = 0}}).find("sigma"),
            std::string::npos);
  EXPECT_NE(problem({.effect = Vortex{.axis = Vec3::Zero()}}).find("axis"), std::string::npos);
  EXPECT_NE(problem({.effect = Turbulence{.octaves = 9}}).find("octaves"), std::string::npos);
}

}  // namespace
}  // namespace offstage::sim
