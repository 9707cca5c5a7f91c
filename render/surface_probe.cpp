#include "render/surface_probe.h"

#include <limits>

namespace offstage::render {

std::vector<float> SurfaceProbe::distances(const Eigen::AlignedBox2i& area_px, const FrameUniforms& frame,
                                           const std::function<void()>& draw) {
  if (depth_ == 0) {
    depth_ = gl::make_target(GL_DEPTH_COMPONENT32F, width_px_, height_px_, GL_NEAREST);
    framebuffer_ = gl::make_framebuffer(0, depth_);
  }
  const Eigen::Vector2i first = area_px.min(), size = area_px.sizes();
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  glEnable(GL_SCISSOR_TEST);
  glScissor(first.x(), first.y(), size.x(), size.y());
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_GREATER);
  const float nothing = 0;
  glClearNamedFramebufferfv(framebuffer_, GL_DEPTH, 0, &nothing);
  draw();
  glDisable(GL_SCISSOR_TEST);
  std::vector<float> values(static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()));
  glReadPixels(first.x(), first.y(), size.x(), size.y(), GL_DEPTH_COMPONENT, GL_FLOAT, values.data());
  for (float& value : values)
    value = value > 0 ? frame.depth.x() / (value + frame.depth.y()) : std::numeric_limits<float>::infinity();
  return values;
}

}  // namespace offstage::render
