#pragma once
/// Shared by the tests that draw: one OpenGL context on the main thread for all tests, and access to the
/// pixels of small pictures.

#include <gtest/gtest.h>

#include "render/primitives.h"
#include "render/stage.h"

namespace offstage::render {

Context& shared_context();

/// A stage without fog and sky, and a camera on the Z axis that looks at the origin.
struct SmallStage {
  explicit SmallStage(int width_px = 96, int height_px = 64)
      : stage(shared_context(), {.width_px = width_px, .height_px = height_px}) {
    stage.set_camera({.eye = {0, 0, 5}, .target = {0, 0, 0}});
    stage.set_environment({.visible = false});
  }
  InstanceHandle add(const Mesh& mesh, const Material& material, const Vector3f& position = {0, 0, 0}) {
    const InstanceHandle instance = stage.add_instance(stage.add_mesh(mesh), stage.add_material(material));
    stage.set_transform(instance, Eigen::Affine3f(Eigen::Translation3f(position)));
    return instance;
  }
  HdrImage draw(const SampleOffsets& offsets = {}) {
    HdrImage picture;
    stage.draw(offsets, picture);
    return picture;
  }
  Stage stage;
};

inline Vector4f pixel(const HdrImage& image, int x, int y) {
  const std::size_t at = 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px) +
                              static_cast<std::size_t>(x));
  return Vector4f(image.rgba[at], image.rgba[at + 1], image.rgba[at + 2], image.rgba[at + 3]);
}
inline Vector4f center_pixel(const HdrImage& image) {
  return pixel(image, image.width_px / 2, image.height_px / 2);
}

/// Returns the position in the picture at which a camera shows a point of the world [px].
inline Vector2f project(const Camera& camera, const Vector3f& point, int width_px, int height_px) {
  const Vector3f forward = (camera.target - camera.eye).normalized();
  const Vector3f right = forward.cross(camera.up).normalized(), up = right.cross(forward);
  const Vector3f d = point - camera.eye;
  const float scale =
      0.5f * static_cast<float>(height_px) / std::tan(camera.fov_deg * 0.00872664626f) / d.dot(forward);
  return {0.5f * static_cast<float>(width_px) + scale * d.dot(right),
          0.5f * static_cast<float>(height_px) - scale * d.dot(up)};
}

}  // namespace offstage::render
