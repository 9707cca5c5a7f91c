#pragma once
/// Draws a model file without other objects, to compare its pixels with the requirements of the file format.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <vector>

#include "gl_fixture.h"
#include "render/image_io.h"
#include "render/mesh_io.h"
#include "render/tone_map.h"

namespace offstage::render {

inline const Vector3f kPureBlack(0, 0, 0), kPureRed(1, 0, 0), kPureGreen(0, 1, 0), kPureBlue(0, 0, 1),
    kPureWhite(1, 1, 1);

/// Writes a picture for tests/render/model_sheet.sh into the folder of the environment variable
/// OFFSTAGE_MODEL_SHEET; does nothing if the variable is not set. The file has the name of the current test.
/// A picture that is equal to the last one is not written.
inline void put_on_sheet(const HdrImage& light) {
  const char* folder = std::getenv("OFFSTAGE_MODEL_SHEET");
  if (folder == nullptr) return;
  static int count = 0;
  Image image{light.width_px, light.height_px, {}};
  for (const float value : light.rgba)
    image.rgba.push_back(static_cast<uint8_t>(std::lround(255 * srgb_encode(std::clamp(value, 0.0f, 1.0f)))));
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
  static std::vector<uint8_t> latest;  // tests draw the picture again for each pixel that they compare
  if (image.rgba == latest) return;
  latest = image.rgba;
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  char name[256];
  std::snprintf(name, sizeof name, "%03d_%s.%s.png", ++count, test->test_suite_name(), test->name());
  write_png(std::filesystem::path(folder) / name, image);
}

/// A picture of a model, seen from z = 5 m. There is no light unless a test adds some.
class ModelPicture {
 public:
  explicit ModelPicture(const std::filesystem::path& file) : model_(read_model(file)) {
    darken();
    for (const Model::Part& part : model_.parts) {
      const InstanceHandle instance = small_.stage.add_instance(
          small_.stage.add_mesh(part.mesh),
          small_.stage.add_material(model_.materials[static_cast<std::size_t>(part.material)],
                                    model_.textures),
          false);
      instances_.push_back(instance);
    }
  }
  void set_sun(const Vector3f& direction, float intensity = 1) {
    small_.stage.set_sun(
        {.direction = direction.normalized(), .color = {1, 1, 1}, .intensity = intensity, .shadows = false});
  }
  /// Sets a sky and a ground of the same colour.
  void set_sky(const Vector3f& color) {
    small_.stage.set_environment({.zenith = color, .horizon = color, .ground = color, .visible = false});
  }
  void look_from(const Vector3f& eye) {
    camera_.eye = eye;
    small_.stage.set_camera(camera_);
  }
  Stage& stage() { return small_.stage; }
  const Model& model() const { return model_; }
  /// Draws the model and returns the colour and alpha at the point (x, y) of the plane z = 0 [m].
  Vector4f at(float x, float y) { return at(draw(), x, y); }
  Vector4f at(const HdrImage& image, float x, float y) const {
    const Vector2f place = project(camera_, {x, y, 0}, 96, 64);
    return pixel(image, static_cast<int>(place.x()), static_cast<int>(place.y()));
  }
  HdrImage draw() {
    HdrImage image = small_.draw();
    put_on_sheet(image);
    return image;
  }
  Vector3f color_at(float x, float y) { return at(x, y).head<3>(); }

 private:
  void darken() {
    set_sky(kPureBlack);
    set_sun({0, 0, 1}, 0);
  }
  SmallStage small_;
  Camera camera_{.eye = {0, 0, 5}, .target = {0, 0, 0}};
  Model model_;
  std::vector<InstanceHandle> instances_;
};

inline void expect_color(const Vector3f& color, const Vector3f& expected, float tolerance = 4e-3f) {
  EXPECT_LT((color - expected).cwiseAbs().maxCoeff(), tolerance)
      << color.transpose() << " for " << expected.transpose();
}

/// Returns a PNG file with these pixels, row by row from the top. `colors`: RGBA, 0 to 1.
inline std::vector<uint8_t> encoded_texels(int width, int height, const std::vector<Vector4f>& colors) {
  Image image{width, height, {}};
  for (const Vector4f& c : colors)
    for (int k = 0; k < 4; ++k) image.rgba.push_back(static_cast<uint8_t>(std::lround(c[k] * 255)));
  image.transparent = true;
  return encode_png(image);
}
inline Vector4f opaque_texel(const Vector3f& color) {
  Vector4f result;
  result << color, 1;
  return result;
}

}  // namespace offstage::render
