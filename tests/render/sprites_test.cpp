// Sprites with pictures. The tests draw without light: particles show the colours of their pictures.

#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "render/sprite_pictures.h"
#include "tests/render/gl_fixture.h"

namespace offstage::render {
namespace {

constexpr std::array<uint8_t, 4> kRed = {255, 0, 0, 255}, kGreen = {0, 255, 0, 255}, kBlue = {0, 0, 255, 255},
                                 kWhite = {255, 255, 255, 255}, kNothing = {255, 255, 255, 0};

/// Returns an image of equal square cells, in rows.
Image cells(int columns, int cell_px, std::initializer_list<std::array<uint8_t, 4>> colors) {
  const int rows = static_cast<int>(colors.size()) / columns;
  Image image{columns * cell_px, rows * cell_px, {}, true};
  for (int y = 0; y < image.height_px; ++y)
    for (int x = 0; x < image.width_px; ++x) {
      const auto& color = *(colors.begin() + y / cell_px * columns + x / cell_px);
      image.rgba.insert(image.rgba.end(), color.begin(), color.end());
    }
  return image;
}

struct SpriteStage : SmallStage {
  SpriteStage() {
    stage.set_sun({.intensity = 0, .shadows = false});
    stage.set_environment({.intensity = 0, .visible = false});
  }
  /// Returns a sprite at the origin; its square is about 35 pixels wide.
  HdrImage drawn(const PointsDef& def, const Image& picture, const Point& point) {
    const PointsHandle set = stage.add_points(def, picture);
    stage.set_points(set, std::array{point});
    const HdrImage image = draw();
    stage.remove(set);
    return image;
  }
  static Point point(float age = 0, float angle = 0) {
    return {.position = {0, 0, 0},
            .velocity = {0, 0, 0},
            .radius = 1,
            .color = {1, 1, 1, 1},
            .id = 3,
            .age = age,
            .angle = angle};
  }
};

const PointsDef kGlowing = {.lit = false, .casts_shadow = false, .stretch_s = 0};

void expect_color(const Vector4f& pixel, float r, float g, float b, float alpha, const char* what) {
  EXPECT_LT((pixel - Vector4f(r, g, b, alpha)).norm(), 0.01f) << what << ": " << pixel.transpose();
}

// Centres of the quarters of the square: a pixel is 0.0569 m at the origin.
constexpr int kLeft = 48 - 9, kRight = 48 + 9, kAbove = 32 - 9, kBelow = 32 + 9;

TEST(StageSprites, ShowTheirPictureUprightAndTransparentWhereItIs) {
  SpriteStage s;
  const HdrImage image = s.drawn(kGlowing, cells(2, 16, {kRed, kGreen, kBlue, kNothing}), s.point());
  expect_color(pixel(image, kLeft, kAbove), 1, 0, 0, 1, "upper left");
  expect_color(pixel(image, kRight, kAbove), 0, 1, 0, 1, "upper right");
  expect_color(pixel(image, kLeft, kBelow), 0, 0, 1, 1, "lower left");
  expect_color(pixel(image, kRight, kBelow), 0, 0, 0, 0, "lower right");
  expect_color(pixel(image, 48 - 16, 32 - 16), 1, 0, 0, 1, "the corner of the square");
  expect_color(pixel(image, 48 - 20, 32), 0, 0, 0, 0, "outside");
}

TEST(StageSprites, AnAngleTurnsThePictureCounterClockwise) {
  SpriteStage s;
  const HdrImage image = s.drawn(kGlowing, cells(2, 16, {kRed, kGreen, kBlue, kWhite}),
                                 s.point(0, std::numbers::pi_v<float> / 2));
  expect_color(pixel(image, kLeft, kBelow), 1, 0, 0, 1, "the upper left corner is now the lower left one");
  expect_color(pixel(image, kLeft, kAbove), 0, 1, 0, 1, "upper left");
  expect_color(pixel(image, kRight, kBelow), 0, 0, 1, 1, "lower right");
}

TEST(StageSprites, AFlipBookShowsThePictureOfItsAge) {
  SpriteStage s;
  const Image sheet = cells(2, 16, {kRed, kGreen, kBlue, kWhite});
  PointsDef def = kGlowing;
  def.sheet = {.columns = 2, .rows = 2, .fps = 10, .blend = false};
  const auto shown = [&](float age) { return center_pixel(s.drawn(def, sheet, s.point(age))); };
  expect_color(shown(0), 1, 0, 0, 1, "first");
  expect_color(shown(0.19f), 0, 1, 0, 1, "second");
  expect_color(shown(0.25f), 0, 0, 1, 1, "third");
  expect_color(shown(0.35f), 1, 1, 1, 1, "fourth");
  expect_color(shown(0.45f), 1, 0, 0, 1, "the first again");
  def.sheet.loop = false;
  expect_color(shown(0.45f), 1, 1, 1, 1, "the last stays");
  def.sheet.loop = def.sheet.blend = true;
  expect_color(shown(0.075f), 0.25f, 0.75f, 0, 1, "three quarters of the way to the second");
  expect_color(shown(0.35f), 1, 0.5f, 0.5f, 1, "half way from the last to the first");
}

// The picture of a particle that is nearer is in front, also of one of another set with another picture.
TEST(StageSprites, AreDrawnInOneOrderWithThoseOfOtherSets) {
  SpriteStage s;
  const PointsHandle red = s.stage.add_points(kGlowing, cells(1, 4, {kRed})),
                     green = s.stage.add_points(kGlowing, cells(1, 4, {kGreen}));
  Point near = s.point(), far = s.point();
  near.position.z() = 0.5f;
  far.position.z() = -0.5f;
  const auto shown = [&](const Point& of_red, const Point& of_green) {
    s.stage.set_points(red, std::array{of_red});
    s.stage.set_points(green, std::array{of_green});
    return center_pixel(s.draw());
  };
  expect_color(shown(near, far), 1, 0, 0, 1, "red in front");
  expect_color(shown(far, near), 0, 1, 0, 1, "green in front");
}

// Sheets share textures, so that sprites of all of them are drawn by few calls.
TEST(SpriteTextures, HoldPicturesOfDifferentSizesTogetherUntilTheyWasteMemory) {
  SmallStage stage;  // provides the GL context
  SpriteTextures textures;
  const auto book = textures.add(sprite_pictures(cells(2, 16, {kRed, kGreen, kBlue, kWhite}), 2, 2));
  const auto wide = textures.add(sprite_pictures(cells(1, 48, {kRed}), 2, 1));
  EXPECT_EQ(textures.add(sprite_pictures(cells(2, 16, {kRed, kGreen, kBlue, kWhite}), 2, 2)), book)
      << "the same pictures";
  textures.update();
  EXPECT_EQ(textures.place(*book).texture, textures.place(*wide).texture);
  EXPECT_NE(textures.place(*book).first_layer, textures.place(*wide).first_layer);
  // A picture of 4 MiB; the 64 pictures of the other sheet would take 256 MiB in layers of its size.
  const auto large = textures.add(sprite_pictures(cells(1, 1024, {kRed}), 1, 1));
  const auto many = textures.add(sprite_pictures(cells(1, 128, {kRed}), 8, 8));
  textures.update();
  EXPECT_NE(textures.place(*large).texture, textures.place(*many).texture);
  EXPECT_GE(textures.place(*many).texture, 1u);
}

TEST(StageSprites, LookTheSameBesideSheetsOfOtherSizes) {
  const Image small = cells(2, 12, {kRed, kGreen, kBlue, kWhite});
  const auto drawn = [&](bool with_others) {
    SpriteStage s;
    if (with_others) {
      s.stage.add_points(kGlowing, cells(1, 64, {kNothing}));
      PointsDef book = kGlowing;
      book.sheet = {.columns = 3, .rows = 1};
      s.stage.add_points(book, cells(1, 90, {kGreen}));
    }
    return s.drawn(kGlowing, small, SpriteStage::point());
  };
  const HdrImage alone = drawn(false), beside = drawn(true);
  for (std::size_t i = 0; i < alone.rgba.size(); ++i) ASSERT_NEAR(alone.rgba[i], beside.rgba[i], 0.02f) << i;
}

TEST(StageSprites, AreLengthenedAlongTheirMotion) {
  SpriteStage s;
  PointsDef def = kGlowing;
  def.stretch_s = 1;
  Point point = s.point(0, 0.3f);
  point.velocity = {4, 0, 0};  // half a length of 2 m, which is twice the radius
  const HdrImage image = s.drawn(def, cells(1, 4, {kWhite}), point);
  EXPECT_GT(pixel(image, 48 + 28, 32).w(), 0.9f);
  EXPECT_GT(pixel(image, 48 - 28, 32).w(), 0.9f);
  EXPECT_LT(pixel(image, 48, 32 - 26).w(), 0.1f);
}

TEST(StageSprites, RefuseSheetsOfImpossibleSize) {
  SpriteStage s;
  PointsDef def = kGlowing;
  def.sheet = {.columns = 64, .rows = 64};
  EXPECT_THROW(s.stage.add_points(def, cells(1, 4, {kRed})), std::invalid_argument);
  def.sheet = {.columns = 5, .rows = 1};
  EXPECT_THROW(s.stage.add_points(def, cells(1, 4, {kRed})), std::invalid_argument);
}

}  // namespace
}  // namespace offstage::render
