#include "producer/build/models.h"

#include <gtest/gtest.h>

#include "producer/format/scene_io.h"
#include "render/mesh_io.h"
#include "tests/render/gltf_samples.h"
#include "tests/render/scratch.h"

namespace offstage::producer {
namespace {

TEST(ModelSize, FitGivesTheLargestSizeWithinABox) {
  render::Model model;  // a flat triangle of 200 x 100
  render::Mesh& mesh = model.parts.emplace_back().mesh;
  mesh.positions = {{0, 0, 0}, {200, 0, 0}, {0, 100, 0}};
  mesh.indices = {0, 1, 2};
  EXPECT_DOUBLE_EQ(fitted_scale(3, std::nullopt, model), 3);
  EXPECT_DOUBLE_EQ(fitted_scale(1, Vec3(2, 2, 2), model), 0.01) << "the longest side decides";
  EXPECT_DOUBLE_EQ(fitted_scale(1, Vec3(2, 0.5, 2), model), 0.005) << "or the tightest";
  EXPECT_DOUBLE_EQ(fitted_scale(1, Vec3(2, 2, 1e-6), model), 0.01) << "a side without extent does not count";
  EXPECT_DOUBLE_EQ(fitted_scale(3, Vec3(2, 2, 2), model), 0.03) << "copies scale the fitted size";
}

render::Model model_of_size(float side, render::Model::UnitSource unit) {
  render::Model model;
  render::Mesh& mesh = model.parts.emplace_back().mesh;
  mesh.positions = {{0, 0, 0}, {side, 0, 0}, {0, 0.5f * side, 0}};
  mesh.indices = {0, 1, 2};
  model.file_size = side;
  model.unit_source = unit;
  return model;
}

TEST(ModelSize, AutoBringsALikelyUnitToMetres) {
  using Source = render::Model::UnitSource;
  ModelScale automatic;
  automatic.automatic = true;
  const auto scale = [&](float side, Source unit) {
    return fitted_scale(automatic, std::nullopt, model_of_size(side, unit));
  };
  EXPECT_EQ(scale(1.8f, Source::none), 1) << "a person in metres";
  EXPECT_EQ(scale(180, Source::none), 0.01) << "in centimetres";
  EXPECT_EQ(scale(1800, Source::none), 0.001) << "in millimetres";
  EXPECT_EQ(scale(80, Source::stated), 1) << "a street in the unit of its file";
  EXPECT_EQ(scale(500, Source::stated), 0.01) << "a model in centimetres in a file that says metres";
  EXPECT_EQ(scale(60, Source::millimetres), 0.001) << "a part for a printer";
  EXPECT_EQ(scale(0.06f, Source::millimetres), 1) << "no part is 0.06 mm large";
  automatic *= 2;
  EXPECT_EQ(scale(180, Source::none), 0.02) << "copies scale the size";
}

/// Returns the scale of bodies with `scale: "auto"` whose shapes are the files or nodes `names` in a folder.
std::vector<Real> automatic_scales(const render::ScratchFolder& folder,
                                   const std::vector<std::string>& names) {
  Scene scene;
  for (const std::string& name : names) {
    MeshFile mesh{name};
    mesh.scale.automatic = true;
    scene.bodies.emplace_back().shape = mesh;
    scene.bodies.back().motion = sim::MotionType::static_body;  // open meshes have no mass
  }
  std::vector<Problem> warnings;
  const ModelLibrary models(scene, SceneFolder(folder.path()), {}, warnings);
  std::vector<Real> scales;
  for (const Body& body : scene.bodies) scales.push_back(scale_of(std::get<MeshFile>(body.shape), models));
  return scales;
}

// A node of a file has the scale of the whole file, although it is small.
TEST(ModelSize, AutoIsTheSameForAllNodesOfAFile) {
  render::GltfSample sample;
  sample.document["nodes"] = {{{"mesh", 0}, {"name", "house"}, {"scale", {300, 300, 300}}},
                              {{"mesh", 0}, {"name", "door"}, {"scale", {20, 20, 20}}}};
  sample.document["scenes"][0]["nodes"] = {0, 1};
  const render::ScratchFolder folder;
  folder.put("a.gltf", sample.text());
  EXPECT_EQ(automatic_scales(folder, {"a.gltf#door"}), std::vector<Real>{0.01});
  EXPECT_EQ(automatic_scales(folder, {"a.gltf", "a.gltf#house", "a.gltf#door"}), std::vector<Real>(3, 0.01));
}

// Instances and skins are where they are drawn, not where their nodes are.
TEST(ModelSize, AutoCountsInstancesAndSkins) {
  render::GltfSample instances;  // two squares, 500 m apart
  instances.document["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  instances.document["nodes"] = {{{"mesh", 0}, {"name", "posts"}}, {{"mesh", 0}, {"name", "stone"}}};
  instances.document["scenes"][0]["nodes"] = {0, 1};
  instances.document["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] =
      instances.accessor(std::vector<float>{0, 0, 0, 500, 0, 0}, "VEC3");

  render::GltfSample skin;  // a skin of 2 m, on a node whose transform is ignored
  skin.set("JOINTS_0", std::vector<uint8_t>(16, 0), "VEC4");
  skin.set("WEIGHTS_0", std::vector<float>{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
  skin.document["skins"] = {{{"joints", {1}}}};
  skin.document["nodes"] = {{{"mesh", 0}, {"skin", 0}, {"name", "hide"}, {"scale", {300, 300, 300}}},
                            {{"name", "bone"}}};
  skin.document["meshes"].push_back(skin.document["meshes"][0]);
  skin.document["nodes"].push_back({{"mesh", 1}, {"name", "box"}});
  skin.document["scenes"][0]["nodes"] = {0, 1, 2};

  const render::ScratchFolder folder;
  folder.put("posts.gltf", instances.text());
  folder.put("hide.gltf", skin.text());
  EXPECT_EQ(automatic_scales(folder, {"posts.gltf", "posts.gltf#posts", "posts.gltf#stone"}),
            std::vector<Real>(3, 0.01));
  EXPECT_EQ(automatic_scales(folder, {"hide.gltf", "hide.gltf#hide", "hide.gltf#box"}),
            std::vector<Real>(3, 1));
}

TEST(ModelSize, AutoIsReadAndWritten) {
  const std::string text =
      R"({"bodies": [{"shape": {"type": "mesh", "file": "rock.glb", "scale": "auto"}}]})";
  const LoadedScene loaded = parse_scene(text, "scene", OFFSTAGE_SOURCE_DIR);
  EXPECT_TRUE(std::get<MeshFile>(loaded.scene.bodies[0].shape).scale.automatic);
  EXPECT_NE(loaded.canonical.find(R"("scale":"auto")"), std::string::npos) << loaded.canonical.substr(0, 400);
  const std::string wrong =
      R"({"bodies": [{"shape": {"type": "mesh", "file": "rock.glb", "scale": "car"}}]})";
  EXPECT_THROW(parse_scene(wrong, "scene", OFFSTAGE_SOURCE_DIR), SceneError);
}

// The decomposition of a large open mesh may take minutes.
TEST(OpenModel, OfADynamicBodyIsRefusedBeforeItsDecomposition) {
  const render::ScratchFolder folder;
  folder.put("shell.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n");
  const LoadedScene loaded = parse_scene(
      R"({"bodies": [{"name": "shell", "shape": {"type": "mesh", "file": "shell.obj"}},
                     {"name": "ball", "position": [0, 5, 0]}]})",
      "scene", folder.path());
  std::vector<Problem> warnings;
  std::vector<std::string> steps;
  try {
    ModelLibrary(loaded.scene, loaded.folder, {}, warnings,
                 [&](const std::string& step) { steps.push_back(step); });
    ADD_FAILURE() << "not refused";
  } catch (const SceneError& error) {
    EXPECT_NE(std::string(error.what()).find("body \"shell\": a dynamic body needs a closed mesh"),
              std::string::npos)
        << error.what();
  }
  EXPECT_TRUE(steps.empty());
}

}  // namespace
}  // namespace offstage::producer
