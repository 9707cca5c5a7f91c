// Joints and articulations of a scene: their copies, what is refused, and that they hold.

#include <set>

#include <gtest/gtest.h>

#include "producer/scene_io.h"
#include "producer/simulation.h"

namespace offstage::producer {
namespace {

LoadedScene parse(const std::string& text) {
  return parse_scene("{" + text + "}", "s", OFFSTAGE_SOURCE_DIR);
}

std::string errors_of(const std::string& text) {
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

TEST(SceneJoints, WhatCannotBeIsRefusedWithWhatCan) {
  const std::string bodies = R"("bodies": [{"name": "wall", "motion": "static"}, {"name": "door"}], )";
  EXPECT_EQ(errors_of(bodies + R"("joints": [{"a": "dor"}])"),
            "/joints/0/a: there is no body 'dor'; did you mean 'door'?\n");
  EXPECT_EQ(errors_of(bodies + R"("joints": [{"a": "wall"}])"),
            "/joints/0: joins nothing that forces can move: one of its bodies must be dynamic\n");
  EXPECT_EQ(errors_of(bodies + R"("joints": [{"type": "revolute", "a": "door", "limits": [-1, 1]},
                                             {"type": "revolute", "a": "door", "limits_deg": [10, 20]}])"),
            "/joints/0/limits: is for prismatic and distance joints; use \"limits_deg\"\n"
            "/joints/1/limits_deg: must be a range that contains 0, where the joint is at time 0\n");
  EXPECT_EQ(errors_of(bodies + R"("joints": [{"a": "door", "motor": {}}])"),
            "/joints/0/motor: drives revolute, prismatic and distance joints only\n");
  EXPECT_EQ(errors_of(bodies + R"("articulations": [{"type": "chain", "end": "world"}])"),
            "/articulations/0/sag: must be over 1.0005 if both ends are held still: a taut chain bears nothing across\n");
  EXPECT_EQ(errors_of(bodies + R"("articulations": [{"type": "chain", "sag": 1.1, "end": "dor"}])"),
            "/articulations/0/end: there is no body 'dor'; did you mean 'door'?\n");
}

// Nothing of a figure that stands still is in anything else of it, or the first step would throw it about.
TEST(Articulations, AreAsTheyStandAndHoldWhenTheyFall) {
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
  EXPECT_LT(simulation.totals().joint_error, 1e-9);
  EXPECT_EQ(simulation.totals().joints_unsolved, 0u);
  for (const auto& [name, handle] : simulation.moving_bodies()) {
    if (name != "ann_0/head") continue;
    EXPECT_LT(simulation.world().body(handle).centre.y(), 1);
  }
}

}  // namespace
}  // namespace offstage::producer
