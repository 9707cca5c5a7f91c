// Cloth and bodies that move together: light bodies that hold cloth, cloth on bodies with joints, and bodies
// that tear cloth.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr Real kCouplingGravity = 9.81;

struct CouplingCase {
  Real step;
  ClothIntegrator integrator;
};

class ClothCoupling : public testing::TestWithParam<CouplingCase> {
 protected:
  static ClothDef sheet(Real side, uint32_t cells, const Pose& pose, const char* fabric) {
    ClothDef def =
        effects::grid_cloth({side, side, cells, cells}, pose, effects::find_fabric(fabric)->fabric);
    def.air.density = 0;
    def.integrator = GetParam().integrator;
    return def;
  }
  static void pin(ClothDef& def, uint32_t vertex, const World& world, BodyHandle body) {
    def.pins.push_back({.vertex = vertex,
                        .body = body,
                        .position = world.body(body).pose.point_to_body(def.vertices[vertex])});
  }
  static void run(World& world, Real seconds) {
    for (int i = 0; i < std::lround(seconds * 60); ++i) world.step(1.0 / 60);
  }
};

// A sheet with one side pinned to a small box falls freely. The cloth that its springs move in a sub-step is
// heavier than the box, and has a far greater moment of inertia. Sheet and box gained 83 m/s and 73 rad/s.
TEST_P(ClothCoupling, FallsFreelyWithASmallBody) {
  for (const Real size : {0.05, 0.02}) {
    World world({.max_step = GetParam().step});
    const BodyHandle box = world.add_body(
        {.shape = Box{Vec3::Constant(size)}, .pose = {Vec3(0, 0, -0.525)}, .mass = 0.2, .collides = false});
    ClothDef def = sheet(1, 16, {}, "cotton");
    for (uint32_t i = 0; i < def.vertices.size(); ++i)
      if (def.vertices[i].z() < -0.5 + 1e-6) pin(def, i, world, box);
    const ClothHandle cloth = world.add_cloth(def);
    run(world, 1);
    EXPECT_LT(world.body(box).angular_velocity.norm(), 0.1) << size;
    for (const Vec3& v : world.cloth(cloth).velocities)
      ASSERT_LT((v - Vec3(0, -kCouplingGravity, 0)).norm(), 0.05) << size;
  }
}

// A small body that a joint holds to the world holds cloth like the world. It turned freely in the first
// sub-step, and the cloth diverged.
TEST_P(ClothCoupling, HangsOnASmallBodyThatAJointHolds) {
  std::vector<Vec3> ends[2];
  for (const bool jointed : {false, true}) {
    World world({.max_step = GetParam().step});
    BodyDef small{
        .shape = Box{Vec3::Constant(0.02)}, .pose = {Vec3(0, 1, -0.5)}, .mass = 1, .collides = false};
    if (!jointed) small.motion = MotionType::static_body;
    const BodyHandle box = world.add_body(small);
    if (jointed) world.add_joint({.type = JointType::fixed, .a = box, .anchor = Vec3(0, 1, -0.5)});
    ClothDef def = sheet(1, 12, {Vec3(0, 1, 0)}, "leather");
    for (ClothSpring& s : def.springs) s.stiffness *= 5;
    def.max_stretch = 0;
    for (uint32_t i = 0; i < def.vertices.size(); ++i)
      if (def.vertices[i].x() < -0.5 + 1e-6) pin(def, i, world, box);
    const ClothHandle cloth = world.add_cloth(def);
    run(world, 0.25);
    const ClothView view = world.cloth(cloth);
    ends[jointed].assign(view.points.begin(), view.points.end());
  }
  Real farthest = 0;
  for (std::size_t i = 0; i < ends[0].size(); ++i)
    farthest = std::max(farthest, (ends[0][i] - ends[1][i]).norm());
  EXPECT_LT(farthest, 1e-3);
}

// A joint makes the mobility of a tray singular. Its inverse threw the sheet off, with 4 J/kg at 1/240 s and
// 8.5 J/kg at 1/60 s.
TEST_P(ClothCoupling, LandsOnATrayWithAJoint) {
  for (const JointType type : {JointType::fixed, JointType::prismatic}) {
    World world({.max_step = GetParam().step});
    const BodyHandle tray =
        world.add_body({.shape = Box{{0.3, 0.04, 0.3}}, .pose = {Vec3(0, 0.5, 0)}, .mass = 5});
    world.add_joint({.type = type, .a = tray, .anchor = Vec3(0, 0.5, 0), .axis = Vec3::UnitX()});
    const ClothHandle cloth = world.add_cloth(sheet(0.5, 10, {Vec3(0.01, 0.56, 0.02)}, "denim"));
    const auto energy = [&] {  // of a kilogram, with equal masses
      const ClothView view = world.cloth(cloth);
      Real sum = 0;
      for (std::size_t i = 0; i < view.points.size(); ++i)
        sum += kCouplingGravity * view.points[i].y() + view.velocities[i].squaredNorm() / 2;
      return sum / static_cast<Real>(view.points.size());
    };
    const Real before = energy();
    for (int i = 0; i < 30; ++i) {
      run(world, 1.0 / 60);
      ASSERT_LT(energy(), before + 0.02) << i;
    }
    for (const Vec3& p : world.cloth(cloth).points) ASSERT_LT(p.head<1>().norm(), 0.4);
  }
}

// A ball whose surface touches the cloth only within triangles tears it: the report names the ball.
TEST_P(ClothCoupling, NamesTheBodyThatTearsIt) {
  World world({.max_step = GetParam().step});
  const BodyHandle ball = world.add_body(
      {.shape = Sphere{0.05}, .pose = {Vec3(0.013, 0.3, 0.017)}, .velocity = {0, -5, 0}, .mass = 5});
  ClothDef def = sheet(1, 20, {}, "cotton");
  def.max_stretch = 0;
  def.tear = 1.1;
  for (uint32_t i = 0; i < def.vertices.size(); ++i)
    if (def.vertices[i].cwiseAbs().maxCoeff() > 0.5 - 1e-6)
      def.pins.push_back({.vertex = i, .position = def.vertices[i]});
  const ClothHandle cloth = world.add_cloth(def);
  std::optional<ClothTear> tear;
  for (int i = 0; i < 12 && !tear; ++i) {
    run(world, 1.0 / 60);
    tear = world.cloth_report(cloth).first_tear;
  }
  ASSERT_TRUE(tear);
  EXPECT_TRUE(tear->touches_body);
  EXPECT_EQ(tear->body, ball);
}

INSTANTIATE_TEST_SUITE_P(All, ClothCoupling,
                         testing::Values(CouplingCase{1.0 / 240, ClothIntegrator::relaxed},
                                         CouplingCase{1.0 / 60, ClothIntegrator::relaxed},
                                         CouplingCase{1.0 / 240, ClothIntegrator::implicit},
                                         CouplingCase{1.0 / 60, ClothIntegrator::implicit}));

}  // namespace
}  // namespace offstage::sim
