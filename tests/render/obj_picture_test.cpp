#include <gtest/gtest.h>

#include "model_picture.h"
#include "render/mtl_file.h"
#include "scratch.h"

// OBJ files with materials: pixels whose colour follows from the MTL format.

namespace offstage::render {
namespace {

// A square of 2 m in the plane z = 0 that faces +Z.
const char kSquare[] =
    "mtllib a.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n"
    "usemtl m\nf 1/1/1 2/2/1 3/3/1 4/4/1\n";

/// A square whose material has the given statements, with the pictures "quad.png" (red, green / blue, white),
/// "mask.png" (white above black) and "ramp.png" (a height that grows to the right).
class Square {
 public:
  explicit Square(const std::string& statements) {
    write_png(folder_ / "quad.png", image_of(2, 2, {255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255}));
    write_png(folder_ / "mask.png", image_of(1, 2, {255, 255, 255, 0, 0, 0}));
    std::vector<int> ramp;
    for (int i = 0; i < 64; ++i) ramp.insert(ramp.end(), 3, 4 * i);
    write_png(folder_ / "ramp.png", image_of(64, 1, ramp));
    folder_.put("a.mtl", "newmtl m\n" + statements);
    picture_.emplace(folder_.put("a.obj", kSquare));
  }
  ModelPicture& picture() { return *picture_; }
  const Material& material() const {
    return picture_->model().materials.at(static_cast<std::size_t>(picture_->model().parts.at(0).material));
  }

 private:
  static Image image_of(int width, int height, const std::vector<int>& rgb) {
    Image image{width, height, {}};
    for (std::size_t i = 0; i < rgb.size(); ++i) {
      image.rgba.push_back(static_cast<uint8_t>(rgb[i]));
      if (i % 3 == 2) image.rgba.push_back(255);
    }
    return image;
  }
  ScratchFolder folder_;
  std::optional<ModelPicture> picture_;
};

TEST(ObjPicture, AMaskCutsTheSquare) {
  Square square("Kd 0 0 0\nKe 1 1 0\nmap_d mask.png\n");
  EXPECT_EQ(square.picture().at(0.3f, -0.7f).w(), 0) << "black is a hole";
  EXPECT_EQ(square.picture().at(0.3f, 0.7f).w(), 1);
  expect_color(square.picture().color_at(0.3f, 0.7f), {1, 1, 0});
}

TEST(ObjPicture, TextureOptionsRepeatAndMoveThePicture) {
  const auto corner = [](const std::string& options, float x, float y) {
    Square square("Kd 0 0 0\nKe 1 1 1\nmap_Ke " + options + " quad.png\n");
    return square.picture().color_at(x, y);
  };
  // The middle of a texel: the first picture's quarters, red and green above blue and white.
  expect_color(corner("", -0.5f, 0.5f), kPureRed, 0.05f);
  expect_color(corner("", -0.5f, -0.5f), kPureBlue, 0.05f);
  // Twice as often: each quarter of the square is a whole picture. A texel is 8.8 pixels wide, so
  // interpolation over half a pixel each way mixes in up to 0.12 of the neighbours.
  for (const auto& [x, y] : {std::pair(-1.0f, 0.0f), std::pair(0.0f, 0.0f), std::pair(0.0f, -1.0f)}) {
    expect_color(corner("-s 2 2 1", x + 0.25f, y + 0.75f), kPureRed, 0.12f);
    expect_color(corner("-s 2 2 1", x + 0.75f, y + 0.25f), kPureWhite, 0.12f);
  }
  expect_color(corner("-o 0.5 0", -0.5f, 0.5f), kPureGreen, 0.05f);
  expect_color(corner("-o 0 0.5 0 -blendu on", -0.5f, 0.5f), kPureBlue, 0.05f);
}

TEST(ObjPicture, HeightsTiltTheSurface) {
  // The height grows by 252 / 255 of a hundredth of the width, so the slope is about -bm / 100 in x.
  const auto light = [](const std::string& statements, float side) {
    Square square("Kd 1 1 1\nKs 0 0 0\n" + statements);
    square.picture().set_sun({side, 0, 1});
    return square.picture().color_at(0.1f, 0).x();
  };
  const float flat = light("", 1);
  EXPECT_NEAR(light("", -1), flat, 0.01f);
  // Slope 0.5: the normal (-0.447, 0, 0.894), cosines 0.316 and 0.949 against 0.707.
  EXPECT_NEAR(light("map_Bump -bm 50 ramp.png\n", 1) / flat, 0.447f, 0.04f);
  EXPECT_NEAR(light("bump -bm 50 ramp.png\n", -1) / flat, 1.342f, 0.06f);
}

TEST(ObjPicture, VertexColoursAreSrgb) {
  const ScratchFolder folder;
  ModelPicture picture(folder.put(
      "a.obj", "v -1 -1 0 0.5 0 0\nv 1 -1 0 0.5 0 0\nv 1 1 0 0.5 0 0\nv -1 1 0 0.5 0 0\nf 1 2 3 4\n"));
  picture.set_sun({0, 0, 1});
  const Vector3f color = picture.color_at(0.1f, 0.1f);
  EXPECT_NEAR(color.x(), 0.214f, 0.04f);
  EXPECT_LT(color.y(), 0.04f);
}

// Programs that know no alpha write 0, which would make the whole model invisible.
TEST(PlyPicture, ColoursOfOpacityZeroAreOpaque) {
  const ScratchFolder folder;
  std::string text = "ply\nformat ascii 1.0\nelement vertex 4\n";
  for (const char* name : {"x", "y", "z"}) text += std::string("property float ") + name + "\n";
  for (const char* name : {"red", "green", "blue", "alpha"})
    text += std::string("property uchar ") + name + "\n";
  text += "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  for (const char* corner : {"-1 -1", "1 -1", "1 1", "-1 1"}) text += std::string(corner) + " 0 255 0 0 0\n";
  ModelPicture picture(folder.put("a.ply", text + "4 0 1 2 3\n"));
  picture.set_sun({0, 0, 1});
  EXPECT_GT(picture.color_at(0.1f, 0.1f).x(), 0.9f);
  ASSERT_EQ(picture.model().warnings.size(), 1u);
  EXPECT_NE(picture.model().warnings[0].find("have opacity 0; drawn opaque"), std::string::npos);
}

TEST(Mtl, StatementsAreParsedAndBrokenOnesSkipped) {
  std::map<std::string, MtlMaterial> materials;
  read_mtl(
      "Pr 0.5\r\nnewmtl a b\r\n  Pr 0.25\r\nPm 1\nmap_Kd -s 2 -o 0.5 0.25 -clamp on my wood.png\r\n"
      "map_Bump -mm 0 1 -bm 0.5 7\nnorm -s\nmap_d\nPr x\n-s\n",
      materials);
  ASSERT_EQ(materials.size(), 1u);
  const MtlMaterial& m = materials.at("a b");
  EXPECT_FALSE(m.roughness.has_value()) << "the last one counts";
  EXPECT_EQ(m.metallic, 1.0f);
  const MtlMap& wood = m.maps.at("map_kd");
  EXPECT_EQ(wood.file, "my wood.png");
  EXPECT_EQ(wood.scale, Vector2f(2, 1));
  EXPECT_EQ(wood.offset, Vector2f(0.5f, 0.25f));
  EXPECT_TRUE(wood.clamp);
  EXPECT_EQ(m.maps.at("bump").file, "7");
  EXPECT_EQ(m.maps.at("bump").bump, 0.5f);
  EXPECT_FALSE(m.maps.contains("map_d"));
}

// Options with fewer than three values, quoted names, and statements because of which assimp would refuse the
// file.
TEST(ObjPicture, TexturesAreFoundAfterOptionsOfAnyLength) {
  for (const char* options :
       {"", "-o 0 0", "-s 1", "-s 1 1 -clamp on", "-s 1 1 1 -o 0 0 0", "-mm 0 1 -texres 64"})
    for (const char* statement : {"map_Kd", "map_Ke"}) {
      Square square("decal quad.png\naniso 0.5\nKd 1 1 1\nKs 0 0 0\nKe 1 1 1\n" + std::string(statement) +
                    " " + options + " \"quad.png\"\n");
      EXPECT_EQ(square.picture().model().textures.size(), 1u) << statement << " " << options;
      if (std::string(statement) == "map_Ke")
        expect_color(square.picture().color_at(-0.5f, -0.5f), kPureBlue, 0.05f);
    }
}

TEST(ObjPicture, StatementsThatAreIgnoredAreNamed) {
  Square square(
      "Kd 1 1 1\nmap_Ks quad.png\nmap_Pr quad.png\nmap_Kd quad.png\nmap_Ka mask.png\ndecal quad.png\naniso "
      "1\nTf 0 1 1\n");
  Square harmless("Kd 1 1 1\nTf 1 1 1\nmap_Kd quad.png\nmap_Ka quad.png\nillum 2\n");
  EXPECT_TRUE(harmless.picture().model().warnings.empty());
  const auto& warnings = square.picture().model().warnings;
  for (const char* key : {"map_ks", "map_pr", "map_ka", "decal", "aniso", "tf"})
    EXPECT_TRUE(std::ranges::any_of(warnings, [&](const std::string& line) {
      return line.find(key) != line.npos;
    })) << key;
}

}  // namespace
}  // namespace offstage::render
