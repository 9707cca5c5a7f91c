#include "render/occlusion_pass.h"

#include <array>

namespace offstage::render {
namespace {

constexpr GLuint kSceneDepthUnit = 4, kOpennessUnit = 8;
constexpr float kWidest = 0.16f;  // share of the picture's height that is looked through
constexpr int kFewSamples = 4;    // up to so many sub-frames, each is smoothed by itself

}  // namespace

OcclusionPass::OcclusionPass(int width_px, int height_px)
    : width_px_((width_px + 1) / 2),
      height_px_((height_px + 1) / 2),
      picture_size_(static_cast<float>(width_px), static_cast<float>(height_px)),
      open_(gl::make_target(GL_RG32F, width_px_, height_px_, GL_NEAREST)),
      smooth_(gl::make_target(GL_RG32F, width_px_, height_px_, GL_NEAREST)),
      open_framebuffer_(gl::make_framebuffer(open_, 0)),
      smooth_framebuffer_(gl::make_framebuffer(smooth_, 0)) {}

void OcclusionPass::draw(GLuint depth, const View& view, float reach, int count, float seed) {
  const bool few = count <= kFewSamples;
  if (reach <= 0) {
    const std::array<float, 4> all = {1, 1, 0, 0};
    glClearNamedFramebufferfv(open_framebuffer_, GL_COLOR, 0, all.data());
    glBindTextureUnit(kOpennessUnit, open_);
    return;
  }
  const float pixels = static_cast<float>(height_px_) / view.tan_half.y();  // per share of the distance
  glViewport(0, 0, width_px_, height_px_);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glBindVertexArray(no_attributes_);
  glBindTextureUnit(kSceneDepthUnit, depth);
  const auto cover = [](GLuint framebuffer) {
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glDrawArrays(GL_TRIANGLES, 0, 3);
  };
  program_.use();
  glUniform4f(0, reach, reach * pixels, kWidest * 2 * static_cast<float>(height_px_), seed);
  glUniform1i(1, count == 1 ? 6 : few ? 6 : 4);
  const Vector2f per_pixel = 2 * view.tan_half.array() / picture_size_.array();
  const Vector2f first = (0.5f * per_pixel).array() - view.tan_half.array() * (1 + view.shear.array());
  glUniform4f(2, per_pixel.x(), per_pixel.y(), first.x(), first.y());
  cover(open_framebuffer_);
  glBindTextureUnit(kOpennessUnit, open_);
  if (few) {
    blur_.use();
    cover(smooth_framebuffer_);
    glBindTextureUnit(kOpennessUnit, smooth_);
  }
  glEnable(GL_DEPTH_TEST);
}

}  // namespace offstage::render
