// Joints and articulations of a scene: their copies, refused values, and that the joints hold.

#include <cmath>
#include <numbers>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"

namespace offstage::producer {
namespace {

LoadedScene parse(const std::string& text) {
  return parse_scene("{" + text + "}", "s", OFFSTAGE_SOURCE_DIR);
}

std::string joint_errors(const std::string& text) {
  try {
    parse(text);
  } catch (const SceneError& error) {
    std::string all;
    for (const Problem& problem : error.problems()) all += problem.where.path + ": " + problem.what + "\n";
    return all;
  }
  return "";
}

TEST(SceneJoints, AreCopiedWithTheirBodies) {
  const LoadedScene loaded = parse(R"(
    "bodies": [{"name": "post", "motion": "static", "shape": {"type": "box"}, "position": [0, 3, 0]},
               {"name": "upper", "position": [0, 2, 0], "repeat": {"count": 3, "offset": [2, 0, 0]}},
               {"name": "lower", "position": [0, 1, 0], "repeat": {"count": 3, "offset": [2, 0, 0]}}],
    "joints": [{"name": "hook", "a": "upper", "b": "post", "anchor": [0, 2.5, 0]},
               {"name": "link", "type": "revolute", "a": "lower", "b": "upper", "anchor": [0, 1.5, 0],
                "limits_deg": [-90, 45], "motor": {"mode": "speed", "target": 180}}])");
  const std::vector<Joint>& joints = loaded.scene.joints;
  ASSERT_EQ(joints.size(), 6u);
  EXPECT_EQ(joints[2].name, "hook_2");
  EXPECT_EQ(joints[2].b, "post");
  EXPECT_EQ(joints[4].a, "lower_1");
  EXPECT_EQ(joints[4].b, "upper_1");
  EXPECT_LT((joints[4].anchor - Vec3(2, 1.5, 0)).norm(), 1e-12);
}

TEST(SceneJoints, InvalidValuesAreRefusedWithTheAllowedOnes) {
  const std::string bodies = R"("bodies": [{"name": "wall", "motion": "static"}, {"name": "door"}], )";
  EXPECT_EQ(joint_errors(bodies + R"("joints": [{"a": "dor"}])"),
            "/joints/0/a: there is no body 'dor'; did you mean 'door'?\n");
  EXPECT_EQ(joint_errors(bodies + R"("joints": [{"a": "wall"}])"),
            "/joints/0: has no dynamic body: at least one of \"a\" and \"b\" must be dynamic\n");
  EXPECT_EQ(joint_errors(bodies + R"("joints": [{"type": "revolute", "a": "door", "limits": [-1, 1]},
                                             {"type": "revolute", "a": "door", "limits_deg": [10, 20]}])"),
            "/joints/0/limits: is for prismatic and distance joints and pulleys; use \"limits_deg\"\n"
            "/joints/1/limits_deg: must be a range that contains 0, the position of the joint at time 0\n");
  EXPECT_EQ(joint_errors(bodies + R"("joints": [{"a": "door", "motor": {}}])"),
            "/joints/0/motor: drives revolute, prismatic, screw and distance joints only\n");
  EXPECT_EQ(joint_errors(bodies + R"("joints": [
                {"type": "revolute", "a": "door", "second_axis": [0, 1, 0], "anchor_b": [0, 1, 0]},
                {"type": "revolute", "a": "door", "motor": {"stiffness": 2, "target": 10,
                 "keys": [{"time": 0, "target": 5}]}}])"),
            "/joints/0/second_axis: is for universal joints, gears and racks\n"
            "/joints/0/anchor_b: is for distance joints, racks and pulleys\n"
            "/joints/1/motor/stiffness: is for the mode \"position\"\n"
            "/joints/1/motor/target: is replaced by \"keys\"; remove one of them\n");
  EXPECT_EQ(joint_errors(bodies + R"("articulations": [{"type": "chain", "end": "world"}])"),
            "/articulations/0/sag: must be above 1.0005 if both ends are fixed: a taut chain cannot carry a "
            "sideways load\n");
  EXPECT_EQ(joint_errors(bodies + R"("articulations": [{"type": "chain", "sag": 1.1, "end": "dor"}])"),
            "/articulations/0/end: there is no body 'dor'; did you mean 'door'?\n");
}

TEST(Articulations, AChainHasEitherAPathOrTwoEnds) {
  const std::string path = R"("path": [[0, 2, 0], [1, 2, 0], [1, 1, 0]])";
  EXPECT_EQ(joint_errors(R"("articulations": [{"type": "chain", )" + path + "}]"), "");
  EXPECT_EQ(joint_errors(R"("articulations": [{"type": "chain", "from": [0, 0.5, 0], )" + path + "}]"),
            "/articulations/0/path: replaces \"from\" and \"to\"; remove them\n");
  EXPECT_EQ(joint_errors(R"("articulations": [{"type": "chain", "path": [[0, 2, 0]]}])"),
            "/articulations/0/path: needs at least two points\n");
}

/// Returns the distance by which the tip of a rod along x, of 1 m length, is below its clamp at x = 0, after
/// each frame.
std::vector<Real> sags_of_rod(int links, const char* solver, Real step, const std::string& rest) {
  const LoadedScene loaded =
      parse(R"("output": {"fps": 60, "duration": 2.5}, "world": {"solver": ")" + std::string(solver) +
            R"(", "step": )" + std::to_string(step) +
            R"(}, "articulations": [{"type": "chain", "from": [0, 1, 0], "to": [1, 1, 0], "links": )" +
            std::to_string(links) + ", " + rest + "}]");
  EXPECT_TRUE(loaded.warnings.empty());
  const ModelLibrary models;
  Simulation simulation(loaded.scene, models);
  std::vector<Real> sags;
  for (int frame = 1; frame < loaded.scene.frame_count(); ++frame) {
    simulation.advance();
    const sim::Pose pose = simulation.world().body(simulation.moving_bodies().back().handle).pose;
    sags.push_back(1 - pose.point_to_world({0, 0.5 / links, 0}).y());
  }
  return sags;
}
/// Returns the weight of the rod per length [N/m]. Its links are capsules.
Real weight_of_rod(int links, Real radius = 0.01, Real density = 2000) {
  return density * 9.81 * std::numbers::pi * radius * radius * (1 - 2 * radius / 3 * links);
}

// A clamped beam under its weight w sags by w L^4 / 8 B, a row of n links by 1 + 1 / n^2 times as much. Here
// that is about 2 % of its length, for which the terms of second order in the slope are below 1 %.
TEST(Articulations, AChainWithBendStiffnessSagsAsACantilever) {
  for (const char* solver : {"auto", "exact", "fast", "lcp"})
    for (const Real step : {1.0 / 240, 1.0 / 60})
      for (const int links : {4, 20}) {
        const Real expected = weight_of_rod(links) / (8 * 30) * (1 + 1.0 / (links * links));
        EXPECT_NEAR(sags_of_rod(links, solver, step,
                                R"("radius": 0.01, "density": 2000, "bend_stiffness": 30, "damping": 4)")
                        .back(),
                    expected, 0.01 * expected)
            << solver << " " << step << " " << links;
      }
}

// The position of rest does not depend on the damping. This includes a rod of light links, which would turn
// far within a sub-step without their springs.
TEST(Articulations, DampingDoesNotHoldAnElasticChainUp) {
  const Real expected = weight_of_rod(32, 0.005, 658) / (8 * 2) * (1 + 1.0 / (32 * 32));
  for (const char* solver : {"exact", "fast"})
    for (const Real step : {1.0 / 240, 1.0 / 60})
      for (const char* damping : {"1", "4"})
        EXPECT_NEAR(sags_of_rod(32, solver, step,
                                R"("radius": 0.005, "density": 658, "bend_stiffness": 2, "damping": )" +
                                    std::string(damping))
                        .back(),
                    expected, 3e-3 * expected)
            << solver << " " << step << " " << damping;
}

// Heavy balls fall on a light rod: they bend it by more than a right angle, or, where it is stiff, bounce
// off. No solver and no step adds energy beyond the error of links that turn far in a sub-step.
TEST(Articulations, BallsThatHitAnElasticChainAddNoEnergy) {
  for (const char* solver : {"auto", "exact", "fast", "lcp"})
    for (const Real step : {1.0 / 240, 1.0 / 60})
      for (const char* stiffness : {"2", "200"}) {
        const std::string world = R"("output": {"fps": 60, "duration": 1.6}, "world": {"solver": ")" +
                                  std::string(solver) + R"(", "step": )" + std::to_string(step) + "}, ";
        const std::string rod =
            R"("articulations": [{"type": "chain", "from": [0, 1, 0], "to": [1, 1, 0], "links": 32,
                "radius": 0.005, "density": 658, "damping": 0.02, "bend_stiffness": )" +
            std::string(stiffness) + "}]";
        const LoadedScene loaded = parse(world + R"("bodies": [
              {"name": "floor", "motion": "static", "shape": {"type": "plane"}},
              {"name": "ball", "shape": {"type": "sphere", "radius": 0.05}, "position": [0.3, 1.6, 0],
               "repeat": {"count": 4, "offset": [0.2, 0.5, 0.003]}}], )" +
                                         rod);
        const ModelLibrary models;
        Simulation simulation(loaded.scene, models);
        const Real start = simulation.world().energy().total();
        Real least = start;
        for (int frame = 1; frame < loaded.scene.frame_count(); ++frame) {
          simulation.advance();
          const Real now = simulation.world().energy().total();
          ASSERT_LT(now, least + 0.03 * start) << solver << " " << step << " " << stiffness << " " << frame;
          least = std::min(least, now);
        }
        EXPECT_LT(least, 0.8 * start) << "no ball has hit it";
      }
}

// A released chain swings with the angular frequency 3.516 sqrt(B / m L^4) of the first mode, to twice the
// sag at rest. The springs act at the end of a sub-step, which damps this mode by the fraction omega h / 2 of
// the critical damping.
TEST(Articulations, AChainWithBendStiffnessSwingsAsACantilever) {
  constexpr int kLinks = 16;
  const Real omega = 3.516 * std::sqrt(30 * 9.81 / weight_of_rod(kLinks));
  const Real rest = weight_of_rod(kLinks) / (8 * 30);
  for (const char* solver : {"auto", "fast"}) {
    const std::vector<Real> sags =
        sags_of_rod(kLinks, solver, 1.0 / 480, R"("radius": 0.01, "density": 2000, "bend_stiffness": 30)");
    const auto end = sags.begin() + static_cast<std::ptrdiff_t>(1.2 * 2 * std::numbers::pi / omega * 60);
    const auto lowest = std::max_element(sags.begin(), end), highest = std::min_element(lowest, end);
    EXPECT_NEAR(static_cast<Real>(highest - lowest) / 60, std::numbers::pi / omega, 1.0 / 60) << solver;
    // Factor of the amplitude in half a period.
    const Real decay = std::exp(-std::numbers::pi * omega / 480 / 2);
    EXPECT_NEAR(*lowest, rest * (1 + decay), 0.1 * rest) << solver;
    EXPECT_NEAR(*highest, rest * (1 - decay * decay), 0.1 * rest) << solver;
  }
}

// A light and very stiff rod stays straight, even if its vibrations are much faster than the sub-step.
TEST(Articulations, AStiffLightChainStaysStraight) {
  for (const char* solver : {"auto", "exact", "fast"})
    for (const Real step : {1.0 / 240, 1.0 / 60})
      for (const Real sag :
           sags_of_rod(32, solver, step, R"("radius": 0.004, "density": 50, "bend_stiffness": 1e6)"))
        ASSERT_NEAR(sag, 0, 2e-3) << solver << " " << step;
}

TEST(Articulations, AChainWithBendStiffnessHasAtMost32Links) {
  EXPECT_EQ(
      joint_errors(R"("articulations": [{"type": "chain", "links": 33, "bend_stiffness": 1}])"),
      "/articulations/0/links: must be at most 32 with \"bend_stiffness\", got 33; the stiffness of the "
      "chain does not depend on their number\n");
  EXPECT_EQ(joint_errors(R"("articulations": [{"type": "chain", "links": 33}])"), "");
  EXPECT_NE(joint_errors(R"("articulations": [{"type": "chain", "bend_stiffness": -1}])"), "");
}

// No parts of a standing figure overlap, because the solver would push them apart in the first step.
TEST(Articulations, StartWithoutOverlapAndHoldWhenTheyFall) {
  const LoadedScene loaded = parse(R"(
    "output": {"fps": 30, "duration": 2},
    "bodies": [{"name": "ground", "motion": "static", "shape": {"type": "plane"}}],
    "articulations": [
      {"type": "ragdoll", "name": "ann", "position": [0, 0.01, 0], "repeat": {"count": 2, "offset": [2, 0, 0]}},
      {"type": "chain", "name": "chain", "from": [0, 3, 3], "to": [2, 3, 3], "links": 20, "sag": 1.1, "end": "world"},
      {"type": "bridge", "name": "bridge", "from": [-3, 1, 6], "to": [3, 1, 6], "planks": 10}])");
  std::set<std::string> names;
  for (const Body& body : loaded.scene.bodies) names.insert(body.name);
  EXPECT_EQ(names.size(), 1u + 2 * 13 + 20 + 10);
  EXPECT_TRUE(names.contains("ann_1/forearm_left"));
  EXPECT_EQ(loaded.scene.joints.size(), 2u * 12 + 21 + 11);
  const ModelLibrary models;
  Simulation simulation(loaded.scene, models);
  for (int frame = 0; frame < 60; ++frame) {
    simulation.advance();
    if (frame != 2) continue;
    for (const auto& [name, handle] : simulation.moving_bodies()) {
      if (!name.starts_with("ann")) continue;
      EXPECT_LT(simulation.world().body(handle).velocity.norm(), 0.8) << name;
    }
  }
  EXPECT_LT(simulation.totals().joints.error, 1e-9);
  EXPECT_EQ(simulation.totals().joints.unsolved, 0u);
  for (const auto& [name, handle] : simulation.moving_bodies()) {
    if (name != "ann_0/head") continue;
    EXPECT_LT(simulation.world().body(handle).centre.y(), 1);
  }
}

sim::BodyHandle handle_of(const Simulation& simulation, const std::string& name) {
  for (const auto& [known, handle] : simulation.moving_bodies())
    if (known == name) return handle;
  throw std::out_of_range(name);
}

// The speed follows from the rear wheels; during the smooth start its mean is half of that. The turning
// circle has the radius L / tan(angle).
TEST(Vehicle, SpeedAndTurningCircleFollowFromTheWheels) {
  const LoadedScene loaded = parse(R"(
    "output": {"fps": 30, "duration": 8}, "world": {"solver": "fast"},
    "materials": [{"name": "road", "friction": 1, "restitution": 0}],
    "bodies": [{"name": "ground", "motion": "static", "shape": {"type": "plane"}, "material": "road"}],
    "articulations": [{"type": "vehicle", "name": "car", "tyre": "road",
      "speed": [{"time": 0.5, "target": 0}, {"time": 3.5, "target": 3}],
      "steer": [{"time": 4, "target": 0}, {"time": 5, "target": 20}]}])");
  const ModelLibrary models;
  Simulation simulation(loaded.scene, models);
  const sim::BodyHandle chassis = handle_of(simulation, "car/chassis");
  const auto advance_to = [&](Real time) {
    while (simulation.world().time() < time) simulation.advance();
    return simulation.world().body(chassis);
  };
  const sim::BodyState standing = advance_to(0.5);
  EXPECT_LT(standing.velocity.norm(), 0.01) << "the springs hold the car at its initial height";
  const sim::BodyState driving = advance_to(4);
  EXPECT_NEAR(driving.velocity.z(), 3, 0.03);
  EXPECT_NEAR(driving.pose.position.z(), 3.0 / 2 * 3 + 3 * 0.5, 0.15);
  EXPECT_NEAR(driving.pose.position.x(), 0, 0.02);
  // The car moves on a circle about a point on the line of the rear axle.
  const sim::BodyState turning = advance_to(6);
  const Real base = 0.62 * 4, radius = base / std::tan(20 * std::numbers::pi / 180);
  EXPECT_NEAR(turning.angular_velocity.y(), turning.velocity.norm() / std::hypot(radius, base / 2), 0.02);
}

TEST(Vehicle, ThatMovesAtTime0RollsOnItsWheels) {
  const LoadedScene loaded = parse(R"(
    "output": {"fps": 30, "duration": 8}, "world": {"solver": "exact"},
    "materials": [{"name": "road", "friction": 1, "restitution": 0}],
    "bodies": [{"name": "ground", "motion": "static", "shape": {"type": "plane"}, "material": "road"}],
    "articulations": [{"type": "vehicle", "name": "car", "tyre": "road", "velocity": [6, 0, 8],
      "orientation": [0.94868330, 0, 0.31622777, 0]}])");
  const ModelLibrary models;
  Simulation simulation(loaded.scene, models);
  while (simulation.world().time() < 1) simulation.advance();
  EXPECT_NEAR(simulation.world().body(handle_of(simulation, "car/chassis")).velocity.norm(), 10, 0.02);
}

TEST(Crane, HoldsItsLoadAndMovesItByItsMotors) {
  const LoadedScene loaded = parse(R"(
    "output": {"fps": 30, "duration": 16}, "world": {"solver": "exact"},
    "articulations": [{"type": "crane", "name": "crane", "height": 8, "reach": 6, "load_mass": 400,
      "hoist": [{"time": 1, "target": 0}, {"time": 5, "target": 2}]}])");
  const ModelLibrary models;
  Simulation simulation(loaded.scene, models);
  const sim::World& world = simulation.world();
  sim::JointHandle rope;
  world.for_each_joint([&](sim::JointHandle j) {
    if (world.joint_def(j).name == "crane/rope") rope = j;
  });
  const Real before = world.joint(rope).anchor_a.y();
  while (world.time() < 1) simulation.advance();
  EXPECT_NEAR(world.joint(rope).force.y(), 400 * 9.81, 1);
  while (world.time() < 6) simulation.advance();
  EXPECT_NEAR(world.joint(rope).anchor_a.y() - before, 2, 1e-3);
  EXPECT_EQ(simulation.snapshot().rods.size(), 1u);
}

TEST(ModelTrees, AreTheNodesOfTheirFile) {
  const std::string arm =
      R"({"type": "model", "name": "arm", "file": "assets/models/robot_arm.glb", "position": [1, 0, 0],
      "orientation": {"axis": [0, 1, 0], "angle_deg": 90}, "scale": 2, "joints": [)";
  const LoadedScene loaded = parse(R"("articulations": [)" + arm + R"({"node": "base", "type": "fixed"},
      {"node": "finger_left", "type": "prismatic", "axis": [1, 0, 0], "limits": [0, 0.1]}]}])");
  const Scene& scene = loaded.scene;
  ASSERT_EQ(scene.bodies.size(), 7u);
  ASSERT_EQ(scene.joints.size(), 7u);
  const Body& hand = scene.bodies[4];
  EXPECT_EQ(hand.name, "arm/hand");
  EXPECT_LT((hand.position - Vec3(1, 2 * 1.97, 0)).norm(), 1e-6);
  const Joint& finger = scene.joints[5];
  EXPECT_EQ(finger.name, "arm/finger_left");
  EXPECT_EQ(finger.b, "arm/hand");
  EXPECT_EQ(finger.behaviour.type, sim::JointType::prismatic);
  EXPECT_LT((finger.behaviour.axis - Vec3(0, 0, -1)).norm(), 1e-6) << "turned with the model";
  EXPECT_LT((finger.anchor - Vec3(1, 2 * 2.135, 0.32)).norm(), 1e-6);
  EXPECT_EQ(scene.joints[0].b, "");

  EXPECT_EQ(
      joint_errors(R"("articulations": [)" + arm +
                   R"({"node": "hnad"}, {"node": "hand", "type": "distance"}]}])"),
      "/articulations/0/joints/0/node: assets/models/robot_arm.glb has no node 'hnad' with triangles; did "
      "you mean 'hand'?\n"
      "/articulations/0/joints/1/type: must not be \"distance\", \"pulley\", \"gear\" or \"rack\": the joint "
      "is at "
      "the origin of the node\n");
  EXPECT_NE(joint_errors(R"("articulations": [{"type": "model", "file": "none.glb"}])")
                .find("/articulations/0/file: "),
            std::string::npos);
}

}  // namespace
}  // namespace offstage::producer
