// Cloths of a scene: selection of their vertices, refused values, and the data for drawing.

#include <algorithm>

#include <gtest/gtest.h>

#include "producer/build/cloth_defs.h"
#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"

namespace offstage::producer {
namespace {

std::string cloth_errors(const std::string& cloth, const std::string& rest = "") {
  try {
    parse_scene(R"({"cloths": [)" + cloth + "]" + rest + "}", "s", OFFSTAGE_SOURCE_DIR);
  } catch (const SceneError& error) {
    std::string text;
    for (const Problem& problem : error.problems()) text += problem.where.path + ": " + problem.what + "\n";
    return text;
  }
  return "";
}

/// Returns a grid of 4 by 2 cells, 2 m by 1 m, with pins.
std::vector<uint32_t> held_by(const std::string& pin) {
  const LoadedScene loaded = parse_scene(
      R"({"cloths": [{"shape": {"type": "grid", "size": [2, 1], "cells": [4, 2]}, "pins": [)" + pin + "]}]}",
      "s", ".");
  const Cloth& cloth = loaded.scene.cloths.at(0);
  return pinned_vertices(cloth.pins.at(0), cloth, flat_cloth(cloth, nullptr));
}

TEST(Cloths, PinsSelectVerticesOfTheFlatCloth) {
  using Vertices = std::vector<uint32_t>;
  EXPECT_EQ(held_by(R"({"type": "corners"})"), (Vertices{0, 4, 10, 14}));
  EXPECT_EQ(held_by(R"({"type": "corners", "corners": ["bottom_right"]})"), (Vertices{14}));
  EXPECT_EQ(held_by(R"({"type": "side", "side": "left"})"), (Vertices{0, 5, 10}));
  EXPECT_EQ(held_by(R"({"type": "side", "side": "bottom", "every": 2})"), (Vertices{10, 12, 14}));
  EXPECT_EQ(held_by(R"({"type": "nearest", "point": [0.6, 0, 0.1]})"), (Vertices{8}));
  EXPECT_EQ(held_by(R"({"type": "box", "centre": [-1, 0, -0.5], "size": [1.1, 1, 0.1]})"), (Vertices{0, 1}));
}

TEST(Cloths, TopIsUpAndTheFrontTowardsTheViewerWhenTurnedByNinetyDegrees) {
  const LoadedScene loaded = parse_scene(
      R"({"cloths": [{"shape": {"type": "grid", "size": [2, 1], "cells": [4, 2]}, "position": [0, 3, 0],
          "orientation": {"axis": [1, 0, 0], "angle_deg": 90}}]})",
      "s", ".");
  const FlatCloth flat = flat_cloth(loaded.scene.cloths.at(0), nullptr);
  EXPECT_LT((flat.def.vertices[0] - Vec3(-1, 3.5, 0)).norm(), 1e-12);
  EXPECT_LT((flat.def.vertices[14] - Vec3(1, 2.5, 0)).norm(), 1e-12);
  for (const sim::Triangle& t : flat.def.triangles) {
    const std::vector<Vec3>& v = flat.def.vertices;
    EXPECT_GT((v[t[1]] - v[t[0]]).cross(v[t[2]] - v[t[0]]).z(), 0);
  }
}

TEST(Cloths, DampingOfTheOtherBendModelIsRefused) {
  EXPECT_EQ(cloth_errors(R"({"bend_spring_damping": 0.1})"),
            "/cloths/0/bend_spring_damping: is for the bend_model \"springs\"; \"bend_damping\" damps the "
            "bending of a plate\n");
  EXPECT_EQ(cloth_errors(R"({"bend_model": "springs", "bend_damping": 0.1})"),
            "/cloths/0/bend_damping: is for the bend_model \"plate\"; \"bend_spring_damping\" damps the "
            "springs between second neighbours\n");
  EXPECT_EQ(cloth_errors(R"({"bend_model": "springs", "bend_spring_damping": 0.1})"), "");
  EXPECT_EQ(cloth_errors(R"({"bend_damping": 0.1})"), "");
}

TEST(Cloths, RefusalsNameTheAllowedValues) {
  EXPECT_EQ(cloth_errors(R"({"fabric": "denin"})"),
            "/cloths/0/fabric: there is no fabric 'denin'; did you mean 'denim'?\n");
  EXPECT_EQ(cloth_errors(R"({"pins": [{"type": "box", "centre": [0, 5, 0]}]})"),
            "/cloths/0/pins/0: the pin selects no vertex; in its own frame the cloth extends from "
            "(-0.5, 0, -0.5) to (0.5, 0, 0.5)\n");
  EXPECT_EQ(
      cloth_errors(R"({"pins": [{"type": "corners", "body": "hand"}]})", R"(, "bodies": [{"name": "band"}])"),
      "/cloths/0/pins/0/body: there is no body 'hand'; did you mean 'band'?\n");
  EXPECT_EQ(cloth_errors(R"({"shape": {"type": "grid", "cells": [900, 900]}})"),
            "/cloths/0: has 811801 vertices; a cloth has at most 250000\n");
  EXPECT_EQ(cloth_errors(R"({"seams": [{"type": "sides", "a": "left", "b": "top"}],
                          "shape": {"type": "grid", "cells": [4, 2]}})"),
            "/cloths/0: joins a side of 3 vertices to a side of 5; the numbers must be equal\n");
  EXPECT_EQ(cloth_errors(R"({"shape": {"type": "mesh", "file": "none.glb"}})")
                .find("/cloths/0/shape/file: there is"),
            0u);
  EXPECT_EQ(cloth_errors("{}", R"(, "forces": [{"type": "wind", "cloths": ["cloth_1"]}])"),
            "/forces/0/cloths/0: there is no cloth 'cloth_1'; did you mean 'cloth_0'?\n");
}

TEST(Cloths, ExplicitIntegratorsNameTheSpringAndTheLongestStep) {
  const std::string stiff =
      cloth_errors(R"({"integrator": "symplectic", "substep": 0.002, "stretch": 100000})");
  EXPECT_EQ(stiff.find("/cloths/0: its springs are too stiff for an explicit integrator: the "), 0u) << stiff;
  EXPECT_NE(stiff.find(" spring between vertices "), std::string::npos) << stiff;
  EXPECT_NE(stiff.find("needs a substep less than"), std::string::npos);
  EXPECT_EQ(cloth_errors(R"({"integrator": "symplectic", "substep": 1e-6})"), "");
}

TEST(Cloths, CopiesAreClothsOfTheirOwnAndForcesNameThemAll) {
  const LoadedScene loaded = parse_scene(
      R"({"cloths": [{"name": "sheet", "shape": {"type": "grid", "cells": [2, 2]}, "repeat": {"count": 3, "offset": [0, 1, 0]}}],
          "forces": [{"type": "wind", "cloths": ["sheet"]}]})",
      "s", ".");
  ASSERT_EQ(loaded.scene.cloths.size(), 3u);
  EXPECT_EQ(loaded.scene.cloths[2].position.y(), 2);
  EXPECT_EQ(std::get<WindField>(loaded.scene.forces.at(0)).cloths,
            (std::vector<std::string>{"sheet_0", "sheet_1", "sheet_2"}));
}

TEST(Cloths, SnapshotsHoldEveryPointOfAPinnedSheet) {
  LoadedScene loaded = parse_scene(
      R"({"cloths": [{"shape": {"type": "grid", "cells": [6, 6]}, "position": [0, 2, 0],
                      "pins": [{"type": "corners"}]}], "output": {"fps": 30, "duration": 0.5}})",
      "s", ".");
  const ModelLibrary models(loaded.scene, loaded.folder, DecompositionCache(), loaded.warnings);
  Simulation simulation(loaded.scene, models);
  for (int i = 0; i < 10; ++i) simulation.advance();
  const Snapshot snapshot = simulation.snapshot();
  ASSERT_EQ(snapshot.cloths.size(), 1u);
  const ClothSample& cloth = snapshot.cloths[0];
  ASSERT_EQ(cloth.points.size(), 49u);
  EXPECT_TRUE(cloth.triangles.empty()) << "a whole cloth has the triangles of the scene";
  EXPECT_LT((cloth.points[0] - Eigen::Vector3f(-0.5f, 2, -0.5f)).norm(), 1e-6f);
  EXPECT_LT(cloth.points[24].y(), 1.99f) << "the middle of the cloth sags";
}

TEST(Cloths, CordsHangOnVerticesAndBodiesAndAreDrawn) {
  LoadedScene loaded = parse_scene(
      R"({"bodies": [{"name": "weight", "shape": {"type": "sphere", "radius": 0.05}, "mass": 0.01, "position": [0, 1, 0]}],
          "cloths": [{"name": "balloon", "shape": {"type": "sphere", "radius": 0.1, "divisions": 1},
                      "position": [0, 2, 0], "fabric": "balloon", "pressure": 3000, "gas_density": 0.17,
                      "cords": [{"from": [0, -0.1, 0], "to": [0, -0.95, 0], "body": "weight", "segments": 5},
                                {"from": [0.1, 0, 0], "to": [0.5, 0, 0], "held": false, "segments": 2}]}],
          "output": {"fps": 30, "duration": 1}})",
      "s", ".");
  const ModelLibrary models(loaded.scene, loaded.folder, DecompositionCache(), loaded.warnings);
  Simulation simulation(loaded.scene, models);
  for (int i = 0; i < 15; ++i) simulation.advance();
  const Snapshot snapshot = simulation.snapshot();
  ASSERT_EQ(snapshot.rods.size(), 7u);
  const std::vector<Eigen::Vector3f>& points = snapshot.cloths.at(0).points;
  const auto is_vertex = [&](const Eigen::Vector3f& p) {
    return std::find(points.begin(), points.begin() + 42, p) != points.begin() + 42;
  };
  EXPECT_TRUE(is_vertex(snapshot.rods[0].a));
  EXPECT_TRUE(is_vertex(snapshot.rods[5].a));
  for (std::size_t i : {0u, 1u, 2u, 3u, 5u}) EXPECT_EQ(snapshot.rods[i].b, snapshot.rods[i + 1].a);
  // The end of the first cord is attached to the top of the weight.
  const BodySample& weight = snapshot.bodies.at(0);
  const Eigen::Vector3f place = weight.position + weight.orientation * Eigen::Vector3f(0, 0.05f, 0);
  EXPECT_LT((snapshot.rods[4].b - place).norm(), 1e-5f);
  // The free end of the second cord has fallen.
  EXPECT_LT(snapshot.rods[6].b.y(), 1.9f);
}

TEST(Cloths, CordsAndGasesThatCannotBeAreRefused) {
  EXPECT_EQ(cloth_errors(R"({"cords": [{"body": "hand"}]})", R"(, "bodies": [{"name": "band"}])"),
            "/cloths/0/cords/0/body: there is no body 'hand'; did you mean 'band'?\n");
  EXPECT_EQ(cloth_errors(R"({"shape": {"type": "sphere"}, "gas_density": 0.2})"),
            "/cloths/0: gas_density needs a pressure > 0\n");
  EXPECT_EQ(cloth_errors(R"({"pressure": 100})"), "/cloths/0: pressure needs a closed surface\n");
  EXPECT_EQ(
      cloth_errors(R"({"shape": {"type": "sphere"}, "cords": [{"from": [0.1, 0, 0], "to": [0.1, 0, 0]}]})")
          .find("/cloths/0: cloth: the ends of a cord are at the same place"),
      0u);
}

}  // namespace
}  // namespace offstage::producer
