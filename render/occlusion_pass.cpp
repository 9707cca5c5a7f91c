#include "render/occlusion_pass.h"

#include <array>

namespace offstage::render {
namespace {

constexpr GLuint kDepthUnit = 4, kOpennessUnit = 8;
constexpr float kWidest = 0.16f;  // greatest radius as a share of the picture's height
constexpr int kFewSamples = 4;    // with at most this many sub-frames, each is smoothed separately

}  // namespace

OcclusionPass::OcclusionPass(int width_px, int height_px)
    : width_px_((width_px + 1) / 2),
      height_px_((height_px + 1) / 2),
      picture_size_(static_cast<float>(width_px), static_cast<float>(height_px)),
      open_(gl::make_target(GL_RG32F, width_px_, height_px_, GL_NEAREST)),
      smooth_(gl::make_target(GL_RG32F, width_px_, height_px_, GL_NEAREST)),
      open_framebuffer_(gl::make_framebuffer(open_, 0)),
      smooth_framebuffer_(gl::make_framebuffer(smooth_, 0)) {}

void OcclusionPass::draw(GLuint depth, const View& view, float reach, const ScreenArea& area, int count,
                         float seed) {
  const bool few = count <= kFewSamples;
  const std::array<float, 4> all = {1, 1, 0, 0};
  glClearNamedFramebufferfv(few ? smooth_framebuffer_ : open_framebuffer_, GL_COLOR, 0, all.data());
  glBindTextureUnit(kOpennessUnit, few ? smooth_ : open_);
  if (reach <= 0 || area.empty()) return;  // its two programs are not built either
  // Pixels per unit of size over distance.
  const float pixels = static_cast<float>(height_px_) / view.tan_half.y();
  glViewport(0, 0, width_px_, height_px_);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glBindVertexArray(no_attributes_);
  glBindTextureUnit(kDepthUnit, depth);
  // The smoothing reads neighbouring texels.
  const Eigen::AlignedBox2i inside = area.pixels(width_px_, height_px_);
  const auto cover = [&](GLuint framebuffer, int around_px) {
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glScissor(inside.min().x() - around_px, inside.min().y() - around_px, inside.sizes().x() + 2 * around_px,
              inside.sizes().y() + 2 * around_px);
    glDrawArrays(GL_TRIANGLES, 0, 3);
  };
  glEnable(GL_SCISSOR_TEST);
  program_.use();
  glUniform4f(0, reach, reach * pixels, kWidest * 2 * static_cast<float>(height_px_), seed);
  glUniform1i(1, count == 1 ? 6 : few ? 6 : 4);
  const Vector2f per_pixel = 2 * view.tan_half.array() / picture_size_.array();
  const Vector2f first = (0.5f * per_pixel).array() - view.tan_half.array() * (1 + view.shear.array());
  glUniform4f(2, per_pixel.x(), per_pixel.y(), first.x(), first.y());
  cover(open_framebuffer_, 1);
  if (few) {
    glBindTextureUnit(kOpennessUnit, open_);
    blur_.use();
    cover(smooth_framebuffer_, 0);
    glBindTextureUnit(kOpennessUnit, smooth_);
  }
  glDisable(GL_SCISSOR_TEST);
  glEnable(GL_DEPTH_TEST);
}

}  // namespace offstage::render
