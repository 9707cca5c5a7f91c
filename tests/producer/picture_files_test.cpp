// Pictures on surfaces and of the sky: allowed keys of a scene, and the resulting drawing.

#include <gtest/gtest.h>

#include "producer/build/drawn_objects.h"
#include "producer/build/lights.h"
#include "producer/format/scene_io.h"
#include "render/file_io.h"
#include "render/frame_files.h"
#include "render/image_io.h"
#include "tests/render/scratch.h"

namespace offstage::producer {
namespace {

/// A folder with a picture of 8x4 pixels, as PNG and as EXR, and one of 4x4.
struct PictureFiles : render::ScratchFolder {
  PictureFiles() {
    render::write_png(path() / "a.png", {8, 4, std::vector<uint8_t>(8 * 4 * 4, 255)});
    render::write_png(path() / "square.png", {4, 4, std::vector<uint8_t>(4 * 4 * 4, 255)});
    render::write_exr(path() / "sky.exr", {8, 4, std::vector<float>(8 * 4 * 4, 2)}, "");
  }
};

/// Problems and warnings of a scene, one a line.
std::string findings_of(const std::string& scene, const PictureFiles& folder) {
  std::string text;
  try {
    const LoadedScene loaded = parse_scene(scene, "scene", folder.path());
    std::vector<Problem> warnings = loaded.warnings;
    const ModelLibrary models(loaded.scene, loaded.folder, {}, warnings);
    for (const Problem& warning : warnings) text += warning.where.path + ": " + warning.what + "\n";
  } catch (const SceneError& error) {
    for (const Problem& problem : error.problems()) text += problem.where.path + ": " + problem.what + "\n";
  }
  return text;
}

render::Material material_of_scene(const std::string& keys, const PictureFiles& folder) {
  const LoadedScene loaded = parse_scene(
      R"({"materials": [{"name": "m", "texture": "a.png", )" + keys + R"(}], "bodies": [{"material": "m"}]})",
      "scene", folder.path());
  std::vector<Problem> warnings;
  const ModelLibrary models(loaded.scene, loaded.folder, {}, warnings);
  std::vector<render::Image> textures;
  return material_of(loaded.scene, "m", models, textures);
}

TEST(Textures, AHeaderWithTooManyPixelsIsReportedWithItsSize) {
  const PictureFiles folder;
  std::vector<uint8_t> bytes = render::read_file(folder.path() / "a.png", 1 << 20);
  for (const std::size_t at : {16u, 20u}) {  // width and height: 60000
    bytes[at + 2] = 0xEA;
    bytes[at + 3] = 0x60;
  }
  render::write_file_atomically(folder.path() / "huge.png", bytes);
  const std::string found = findings_of(
      R"({"materials": [{"name": "m", "texture": "huge.png"}], "bodies": [{"material": "m"}]})", folder);
  EXPECT_NE(found.find("60000x60000 pixels; at most"), std::string::npos) << found;
}

TEST(Textures, AreScaledAndTurnedAboutTheirCentre) {
  const PictureFiles folder;
  const render::Material m = material_of_scene(R"("texture_scale": 0.5, "texture_angle_deg": 90)", folder);
  const auto texel = [&](float u, float v) {
    const Eigen::Vector3f place(u, v, 1);
    return Eigen::Vector2f(m.base_color_texture.rows[0].dot(place), m.base_color_texture.rows[1].dot(place));
  };
  EXPECT_NEAR((texel(0.5f, 0.5f) - Eigen::Vector2f(0.5f, 0.5f)).norm(), 0, 1e-6f);
  // The texture is turned counter-clockwise, so the lower edge of the picture is at the right. The texture
  // has half its size, so the edge is half as far away.
  EXPECT_NEAR((texel(0.75f, 0.5f) - Eigen::Vector2f(0.5f, 1)).norm(), 0, 1e-6f);
  EXPECT_FALSE(m.triplanar);
}

TEST(Textures, TriplanarOnesHaveTheirWidthInMetres) {
  const PictureFiles folder;
  const render::Material m =
      material_of_scene(R"("texture_scale": 4, "texture_projection": "triplanar")", folder);
  EXPECT_TRUE(m.triplanar && m.is_detailed());
  EXPECT_FLOAT_EQ(m.base_color_texture.rows[0].x(), 0.25f);
  EXPECT_FLOAT_EQ(m.base_color_texture.rows[1].y(), 0.5f) << "the picture is half as high as wide";
}

TEST(Textures, OptionsWithoutEffectAreNamed) {
  const PictureFiles folder;
  EXPECT_EQ(
      findings_of(R"({"materials": [{"name": "m", "texture_scale": 2}], "bodies": [{"material": "m"}]})",
                  folder),
      "/materials/0/texture_scale: has no effect: the material has no \"texture\"\n");
  EXPECT_EQ(
      findings_of(R"({"materials": [{"name": "m", "texture": "a.png", "texture_projection": "triplanar"}],
                            "cloths": [{"name": "c", "material": "m"}]})",
                  folder),
      "/materials/0/texture_projection: the cloth 'c' has this material; \"triplanar\" is for bodies\n");
}

TEST(SkyPictures, LightASceneWithoutASun) {
  const PictureFiles folder;
  const auto scene = [&](const std::string& more) {
    return parse_scene(
               R"({"environment": {"picture": {"file": "sky.exr", "turn_deg": 30, "visible": false}})" +
                   more + "}",
               "scene", folder.path())
        .scene;
  };
  EXPECT_EQ(sun_of(scene(""), {}).intensity, 0);
  EXPECT_GT(sun_of(scene(R"(, "lights": [{"type": "sun"}])"), {}).intensity, 0);
  const render::Environment environment = environment_of(scene(""));
  EXPECT_EQ(environment.picture_turn_deg, 30);
  EXPECT_FALSE(environment.picture_visible);
  std::vector<Problem> warnings;
  const ModelLibrary models(scene(""), SceneFolder(folder.path()), {}, warnings);
  ASSERT_TRUE(models.sky());
  EXPECT_NEAR(models.sky()->seen({0, 0, -1}).x(), 2, 0.01f);
}

TEST(SkyPictures, OfAWrongKindAreRefusedWithTheirPlace) {
  const PictureFiles folder;
  const auto with = [&](const std::string& environment) {
    return findings_of(R"({"environment": {)" + environment + "}}", folder);
  };
  EXPECT_EQ(with(R"("picture": {"file": "a.png"})"), "");
  EXPECT_EQ(
      with(R"("picture": {"file": "square.png"})"),
      "/environment/picture: square.png: a picture of the sky must be twice as wide as high, got 4x4\n");
  EXPECT_EQ(with(R"("picture": {"file": "a.png"}, "clouds": 0.5)"),
            "/environment/clouds: a sky from a picture has the clouds of the picture; remove \"clouds\" or "
            "\"picture\"\n");
  EXPECT_NE(with(R"("picture": {"file": "none.hdr"})").find("/environment/picture/file: "),
            std::string::npos);
}

}  // namespace
}  // namespace offstage::producer
