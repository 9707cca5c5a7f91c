#include "render/picture_copy.h"

#include <algorithm>

namespace offstage::render {

PictureCopy::PictureCopy(GLenum format, GLenum filter, GLuint unit, int width_px, int height_px)
    : format_(format),
      filter_(filter),
      unit_(unit),
      all_px_(Eigen::Vector2i(0, 0), Eigen::Vector2i(width_px, height_px)) {
  change_all();
}

void PictureCopy::change(const Eigen::AlignedBox2i& area_px) {
  constexpr std::size_t kMostAreas = 64;  // more areas are merged to one
  Eigen::AlignedBox2i area = area_px.intersection(all_px_);
  if (area.isEmpty()) return;
  const bool joins = area.contains(all_px_) || changed_px_.size() == kMostAreas;
  if (joins) {
    for (const Eigen::AlignedBox2i& other : changed_px_) area.extend(other);
    changed_px_.clear();
  }
  changed_px_.push_back(area);
}

void PictureCopy::update(GLuint picture, const Eigen::AlignedBox2i& area_px) {
  if (texture_ == 0) texture_ = gl::make_target(format_, all_px_.max().x(), all_px_.max().y(), filter_);
  std::erase_if(changed_px_, [&](const Eigen::AlignedBox2i& area) {
    if (!area.intersects(area_px)) return false;
    glCopyImageSubData(picture, GL_TEXTURE_2D, 0, area.min().x(), area.min().y(), 0, texture_, GL_TEXTURE_2D,
                       0, area.min().x(), area.min().y(), 0, area.sizes().x(), area.sizes().y(), 1);
    return true;
  });
  glBindTextureUnit(unit_, texture_);
}

}  // namespace offstage::render
