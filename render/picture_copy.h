#pragma once
/// Private: a copy of the picture's colour or depth that shaders read while they draw over the picture.

#include <vector>

#include <Eigen/Geometry>

#include "render/gl.h"

namespace offstage::render {

class PictureCopy {
 public:
  /// Describes a copy whose texture is created on first use. `unit`: texture unit to which the copy is bound.
  PictureCopy(GLenum format, GLenum filter, GLuint unit, int width_px, int height_px);
  /// Marks an area of the picture as changed.
  void change(const Eigen::AlignedBox2i& area_px);
  void change_all() { change(all_px_); }
  /// Updates at least `area_px` of the copy, and binds it. Only areas that have changed since the last copy
  /// are copied.
  void update(GLuint picture, const Eigen::AlignedBox2i& area_px);

 private:
  GLenum format_, filter_;
  GLuint unit_;
  Eigen::AlignedBox2i all_px_;
  gl::Texture texture_;
  std::vector<Eigen::AlignedBox2i> changed_px_;
};

}  // namespace offstage::render
