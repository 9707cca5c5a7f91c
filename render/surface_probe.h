#pragma once
/// Private: measures the distance to the surface of a single body in each pixel.

#include <functional>
#include <vector>

#include "render/frame.h"
#include "render/gl.h"

namespace offstage::render {

class SurfaceProbe {
 public:
  SurfaceProbe(int width_px, int height_px) : width_px_(width_px), height_px_(height_px) {}
  /// Returns the distances along the view axis [m] in an area of the picture, by rows. They are infinite
  /// where `draw` draws nothing. `draw` must write depth. The framebuffer binding is changed.
  std::vector<float> distances(const Eigen::AlignedBox2i& area_px, const FrameUniforms& frame,
                               const std::function<void()>& draw);

 private:
  int width_px_, height_px_;
  gl::Texture depth_;  ///< created on first use
  gl::Framebuffer framebuffer_;
};

}  // namespace offstage::render
