#pragma once
/// Private: a copy of the picture's colour or depth that shaders read while they draw over the picture.

#include <vector>

#include <Eigen/Geometry>

#include "render/gl.h"

namespace offstage::render {

class PictureCopy {
 public:
  /// `unit`: the texture unit it is bound to. The texture is made when first needed.
  PictureCopy(GLenum format, GLenum filter, GLuint unit, int width_px, int height_px);
  /// The picture has changed there.
  void change(const Eigen::AlignedBox2i& area_px);
  void change_all() { change(all_px_); }
  /// Copies what has changed and lies in one piece with the area, at most once for each change, and binds the
  /// copy.
  void update(GLuint picture, const Eigen::AlignedBox2i& area_px);
  void update_all(GLuint picture) { update(picture, all_px_); }
  /// 0 before the first update.
  GLuint texture() const { return texture_; }

 private:
  GLenum format_, filter_;
  GLuint unit_;
  Eigen::AlignedBox2i all_px_;
  gl::Texture texture_;
  std::vector<Eigen::AlignedBox2i> changed_px_;
};

}  // namespace offstage::render
