// The estimated fraction of each object in the work of a scene.

#include "producer/run/cost.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "producer/format/scene_templates.h"

namespace offstage::producer {
namespace {

const ObjectCost& find_cost(const std::vector<ObjectCost>& costs, const std::string& name) {
  const auto it = std::ranges::find(costs, name, &ObjectCost::name);
  if (it == costs.end()) throw std::out_of_range(name);
  return *it;
}

TEST(Cost, ObjectsAreCountedWithTheirCopiesAndComparedByTheirSize) {
  const LoadedScene film = parse_scene(R"({
    "bodies": [{"name": "floor", "motion": "static", "shape": {"type": "plane"}},
               {"name": "crate", "position": [0, 9, 0], "grid": {"count": [3, 3, 3], "spacing": [2, 2, 2]}}],
    "cloths": [{"name": "rag", "shape": {"type": "grid", "cells": [10, 10]}, "position": [0, 3, 0]},
               {"name": "sheet", "shape": {"type": "grid", "cells": [100, 100]}, "position": [0, 4, 0]}],
    "emitters": [{"name": "jet", "rate": 1000, "lifespan": 2, "surface": {"position": [0, 1, 0]}}]})",
                                       "s", "");
  const std::vector<ObjectCost> costs = object_costs(film.scene, ModelLibrary());
  EXPECT_EQ(find_cost(costs, "crate_0").count, 27u);
  EXPECT_EQ(find_cost(costs, "floor").simulation_s, 0);
  EXPECT_EQ(find_cost(costs, "sheet").size.substr(0, 15), "10 201 vertices");
  EXPECT_NEAR(find_cost(costs, "sheet").simulation_s / find_cost(costs, "rag").simulation_s, 10201.0 / 121,
              1e-9);
  EXPECT_GT(find_cost(costs, "sheet").simulation_s, find_cost(costs, "crate_0").simulation_s);
  EXPECT_GE(find_cost(costs, "jet").particles, 2000u);
  EXPECT_LE(find_cost(costs, "jet").particles, 2200u);
}

TEST(Templates, AreCommentedScenesWithoutAnyProblem) {
  ASSERT_GE(templates().size(), 6u);
  for (const char* name : {"basic", "sprinkler", "rain", "explosion", "cloth", "machine"})
    EXPECT_NE(std::ranges::count(template_names(), name), 0) << name;
  for (const auto& [name, text] : templates()) {
    SCOPED_TRACE(std::string(name));
    EXPECT_FALSE(template_description(text).empty());
    EXPECT_GE(std::ranges::count(text, '/'), 10) << "it has comments";
    const LoadedScene film = parse_scene(scene_from_template(text, "my film.json"), "s.json", "");
    EXPECT_TRUE(film.warnings.empty()) << film.warnings.front().describe();
    EXPECT_LE(film.scene.output.duration, 5);
    EXPECT_NE(scene_from_template(text, "my.json").find("offstage my.json"), std::string::npos);
  }
}

}  // namespace
}  // namespace offstage::producer
