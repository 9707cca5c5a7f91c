// Animations of glTF files: nodes, skins and morph targets over time.

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "gltf_samples.h"
#include "render/error.h"
#include "render/mesh_io.h"
#include "scratch.h"

namespace offstage::render {
namespace {

Model with_rig(const GltfSample& sample) {
  const ScratchFolder folder;
  return read_model(folder.put("a.gltf", sample.text()), {}, {}, true);
}

/// Adds an animation of one property of one node.
void animate(GltfSample& sample, int node, const char* path, const std::vector<float>& times,
             const std::vector<float>& values, const char* type, const char* interpolation = "LINEAR") {
  const int input = sample.accessor(times, "SCALAR"), output = sample.accessor(values, type);
  sample.document["animations"].push_back(
      {{"name", std::string("clip_") + path},
       {"samplers", {{{"input", input}, {"output", output}, {"interpolation", interpolation}}}},
       {"channels", {{{"sampler", 0}, {"target", {{"node", node}, {"path", path}}}}}}});
}

Vector3f origin_of(const Model& model, int clip, float time, std::size_t node = 0) {
  return pose_at(model.rig, clip, time).world[node].translation();
}

TEST(GltfAnimations, InterpolateAsTheirSamplersSayAndHoldTheirEnds) {
  GltfSample sample;
  const std::vector<float> times = {1, 2, 4}, places = {0, 0, 0, 2, 0, 0, 2, 8, 0};
  animate(sample, 0, "translation", times, places, "VEC3");
  animate(sample, 0, "translation", times, places, "VEC3", "STEP");
  // Tangent in, value, tangent out of each key: a flight from (0, 0, 0) with (4, 0, 0) m/s to rest.
  animate(sample, 0, "translation", {0, 2}, {0, 0, 0, 0, 0, 0, 4, 0, 0, 0, 0, 0, 4, 0, 0, 0, 0, 0}, "VEC3",
          "CUBICSPLINE");
  const Model model = with_rig(sample);
  ASSERT_EQ(model.rig.clips.size(), 3u);
  EXPECT_EQ(model.rig.clips[0].name, "clip_translation");
  EXPECT_FLOAT_EQ(model.rig.clips[0].duration, 4);
  const auto expect_at = [&](int clip, float time, const Vector3f& place) {
    EXPECT_LT((origin_of(model, clip, time) - place).norm(), 1e-5f) << clip << " at " << time;
  };
  expect_at(0, 0, {0, 0, 0});
  expect_at(0, 1.25f, {0.5f, 0, 0});
  expect_at(0, 3, {2, 4, 0});
  expect_at(0, 9, {2, 8, 0});
  expect_at(1, 1.9f, {0, 0, 0});
  expect_at(1, 2, {2, 0, 0});
  // Hermite: x(s) = (s3 - 2 s2 + s) 2 * 4 + (3 s2 - 2 s3) * 4 at s = 1/2.
  expect_at(2, 1, {1 + 2, 0, 0});
  expect_at(-1, 3, {0, 0, 0});
}

TEST(GltfAnimations, TurnAtAConstantRateAndChildrenFollow) {
  GltfSample sample;
  sample.document["nodes"] = {{{"children", {1}}}, {{"mesh", 0}, {"translation", {2, 0, 0}}}};
  const float h = std::numbers::sqrt2_v<float> / 2;
  animate(sample, 0, "rotation", {0, 1}, {0, 0, 0, 1, 0, 0, h, h}, "VEC4");  // a quarter turn about z
  const Model model = with_rig(sample);
  const float angle = std::numbers::pi_v<float> / 6;  // a third of the turn
  EXPECT_LT((origin_of(model, 0, 1.0f / 3, 1) - Vector3f(2 * std::cos(angle), 2 * std::sin(angle), 0)).norm(),
            1e-5f);
  ASSERT_EQ(model.rig.surfaces.size(), 1u);
  EXPECT_FALSE(model.rig.surfaces[0].deforms());
  EXPECT_EQ(model.rig.surfaces[0].node, 1);
}

TEST(GltfAnimations, SkinsFollowTheirJoints) {
  GltfSample sample;
  sample.set("JOINTS_0", std::vector<uint8_t>{0, 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0}, "VEC4");
  sample.set("WEIGHTS_0", std::vector<float>{1, 0, 0, 0, 1, 0, 0, 0, 0.5f, 0, 0, 0, 0.5f, 0.5f, 0, 0},
             "VEC4");
  sample.document["skins"] = {{{"joints", {1, 2}}}};
  sample.document["nodes"] = {
      {{"mesh", 0}, {"skin", 0}, {"translation", {100, 0, 0}}}, {{"name", "still"}}, {{"name", "bone"}}};
  sample.document["scenes"][0]["nodes"] = {0, 1, 2};
  animate(sample, 2, "translation", {0, 1}, {0, 0, 0, 0, 0, 4}, "VEC3");
  const Model model = with_rig(sample);
  ASSERT_EQ(model.rig.surfaces.size(), 1u);
  const Mesh mesh = deformed(model.rig, model.rig.surfaces[0], pose_at(model.rig, 0, 0.5f));
  const std::vector<Vector3f> expected = {{-1, -1, 0}, {1, -1, 2}, {1, 1, 2}, {-1, 1, 1}};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_LT((mesh.positions[i] - expected[i]).norm(), 1e-5f) << i;
}

TEST(GltfAnimations, MorphTargetsFollowTheirWeightsAndFlatFacesStayFlat) {
  GltfSample sample;
  sample.primitive()["attributes"].erase("NORMAL");
  const int up = sample.accessor(std::vector<float>{0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 2}, "VEC3");
  sample.primitive()["targets"] = {{{"POSITION", up}}};
  animate(sample, 0, "weights", {0, 2}, {0, 1}, "SCALAR");
  const Model model = with_rig(sample);
  ASSERT_EQ(model.rig.surfaces.size(), 1u);
  // At the end the face rises by 2 over 2: its normal leans back by 45 degrees.
  const Mesh mesh = deformed(model.rig, model.rig.surfaces[0], pose_at(model.rig, 0, 2));
  for (const Vector3f& normal : mesh.normals)
    EXPECT_LT((normal - Vector3f(0, -1, 1).normalized()).norm(), 1e-5f);
  const Mesh half = deformed(model.rig, model.rig.surfaces[0], pose_at(model.rig, 0, 1));
  float highest = 0;
  for (const Vector3f& p : half.positions) highest = std::max(highest, p.z());
  EXPECT_FLOAT_EQ(highest, 1);
  EXPECT_TRUE(model.warnings.empty());
  sample.primitive()["targets"][0]["TEXCOORD_0"] = sample.accessor(std::vector<float>(8, 0), "VEC2");
  ASSERT_EQ(with_rig(sample).warnings.size(), 1u);
  EXPECT_NE(with_rig(sample).warnings[0].find("targets of TEXCOORD_0 are ignored"), std::string::npos);
}

TEST(GltfAnimations, AreListedAndReadOnRequest) {
  GltfSample sample;
  animate(sample, 0, "translation", {0, 2.5f}, {0, 0, 0, 1, 0, 0}, "VEC3");
  const ScratchFolder folder;
  const Model model = read_model(folder.put("a.gltf", sample.text()));
  ASSERT_EQ(model.clips.size(), 1u);
  EXPECT_FLOAT_EQ(model.clips[0].duration, 2.5f);
  EXPECT_TRUE(model.rig.surfaces.empty());
  ASSERT_EQ(model.warnings.size(), 1u);
  EXPECT_NE(model.warnings[0].find("not played"), std::string::npos);
  EXPECT_TRUE(with_rig(sample).warnings.empty());
}

TEST(GltfAnimations, LiesAreRefused) {
  const auto why_not = [](const std::vector<float>& times, const std::vector<float>& values) -> std::string {
    GltfSample sample;
    animate(sample, 0, "translation", times, values, "VEC3");
    try {
      with_rig(sample);
    } catch (const FileError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(why_not({0, 1}, {0, 0, 0}).find("3 numbers for 2 keys"), std::string::npos);
  EXPECT_NE(why_not({1, 0}, {0, 0, 0, 1, 1, 1}).find("do not increase"), std::string::npos);
  EXPECT_NE(why_not({0, 1}, {0, 0, 0, std::nanf(""), 1, 1}), "");
  GltfSample pointer;
  animate(pointer, 0, "pointer", {0, 1}, {0, 0, 0, 1, 1, 1}, "VEC3");
  const Model model = with_rig(pointer);
  ASSERT_EQ(model.warnings.size(), 1u);
  EXPECT_NE(model.warnings[0].find("'pointer' is ignored"), std::string::npos);
}

}  // namespace
}  // namespace offstage::render
